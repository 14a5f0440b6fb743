//! Files made of arrays: binary PLY for meshes, PNG for levels, OpenEXR for light.
//!
//! Python (`_arrays.py`) has checked the arrays, and passes their bytes: little-endian, row by row. Any program can
//! read the files, and they hold each number unchanged.

use std::fmt::Write as _;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rayon::prelude::*;

use crate::error::guarded;
use crate::given::Given;
use crate::place::Place;

/// A property of a vertex: its name, its type in PLY and the bytes of a value.
type Column<'a> = (&'a [&'a str], &'static str, usize, &'a [u8]);

/// The number of vertices or faces that are written in one piece: few enough to stay in the cache.
const PIECE: usize = 1 << 13;

/// Returns the PLY type for a NumPy type, and the number of bytes of a value.
fn type_of(name: &str) -> PyResult<(&'static str, usize)> {
    Ok(match name {
        "u1" => ("uchar", 1),
        "u2" => ("ushort", 2),
        "f4" => ("float", 4),
        "f8" => ("double", 8),
        _ => return Err(PyValueError::new_err(format!("the type {name} is not one of a mesh"))),
    })
}

/// Makes the file of a mesh. Each attribute of vertices is the type and the bytes; `faces` are 32-bit indices, a number of
/// `corners` for each.
#[pyfunction]
pub(crate) fn mesh_file(
    py: Python<'_>,
    vertices: (String, Bound<'_, PyBytes>),
    faces: &Bound<'_, PyBytes>,
    corners: u8,
    normals: Option<(String, Bound<'_, PyBytes>)>,
    colors: Option<(String, Bound<'_, PyBytes>)>,
    uv: Option<(String, Bound<'_, PyBytes>)>,
) -> PyResult<Given> {
    let mut columns: Vec<Column<'_>> = Vec::new();
    let attributes: [(&[&str], _); 4] = [
        (&["x", "y", "z"], Some(&vertices)),
        (&["nx", "ny", "nz"], normals.as_ref()),
        (&["red", "green", "blue"], colors.as_ref()),
        (&["s", "t"], uv.as_ref()),
    ];
    for (names, attribute) in attributes {
        if let Some((kind, bytes)) = attribute {
            let (kind, size) = type_of(kind)?;
            columns.push((names, kind, size * names.len(), bytes.as_bytes()));
        }
    }
    let count = columns[0].3.len() / columns[0].2;
    let faces = faces.as_bytes();
    let is_whole = columns.iter().all(|(.., size, bytes)| bytes.len() == count * size)
        && corners >= 3
        && faces.len().is_multiple_of(4 * usize::from(corners));
    if !is_whole {
        return Err(PyValueError::new_err("the attributes of a mesh differ in their lengths"));
    }
    py.detach(|| guarded(|| Given::new("mesh", ".ply", ply(&columns, count, faces, corners))))
}

fn ply(columns: &[Column<'_>], count: usize, faces: &[u8], corners: u8) -> Vec<u8> {
    let of_face = 4 * usize::from(corners);
    let mut head = format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n");
    for (names, kind, ..) in columns {
        for name in *names {
            let _ = writeln!(head, "property {kind} {name}");
        }
    }
    let _ = write!(
        head,
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        faces.len() / of_face
    );
    let of_vertex: usize = columns.iter().map(|(.., size, _)| size).sum();
    let start = head.len();
    let end = start + count * of_vertex;
    let mut file = head.into_bytes();
    if let [(.., bytes)] = columns {
        file.reserve_exact(bytes.len() + faces.len() / of_face * (of_face + 1));
        file.extend_from_slice(bytes);
    }
    file.resize(end + faces.len() / of_face * (of_face + 1), 0);
    let (vertices, rows) = file[start..].split_at_mut(count * of_vertex);
    // Small ones are written here: after a fork there is no pool of threads.
    if count.max(faces.len() / of_face) <= PIECE {
        write_vertices(vertices, columns, of_vertex, 0);
        write_faces(rows, faces, corners);
    } else {
        let pieces = vertices.par_chunks_mut(PIECE * of_vertex).enumerate();
        pieces.for_each(|(piece, rows)| write_vertices(rows, columns, of_vertex, piece * PIECE));
        let rows = rows.par_chunks_mut(PIECE * (of_face + 1));
        rows.zip(faces.par_chunks(PIECE * of_face))
            .for_each(|(rows, faces)| write_faces(rows, faces, corners));
    }
    file
}

/// Writes the attributes of vertices, starting at vertex `first`. Positions alone are in the right form already.
fn write_vertices(rows: &mut [u8], columns: &[Column<'_>], of_vertex: usize, first: usize) {
    if columns.len() == 1 {
        return;
    }
    let mut offset = 0;
    for (.., size, bytes) in columns {
        let values = bytes[first * size..].chunks_exact(*size);
        for (row, values) in rows.chunks_exact_mut(of_vertex).zip(values) {
            row[offset..offset + size].copy_from_slice(values);
        }
        offset += size;
    }
}

fn write_faces(rows: &mut [u8], faces: &[u8], corners: u8) {
    let write = |row: &mut [u8], face: &[u8]| {
        row[0] = corners;
        row[1..].copy_from_slice(face);
    };
    // Rows of known lengths are copied faster, and most are triangles.
    if corners == 3 {
        let rows = rows.as_chunks_mut::<13>().0.iter_mut();
        rows.zip(faces.as_chunks::<12>().0).for_each(|(row, face)| write(row, face));
    } else {
        let of_face = 4 * usize::from(corners);
        let rows = rows.chunks_exact_mut(of_face + 1);
        rows.zip(faces.chunks_exact(of_face)).for_each(|(row, face)| write(row, face));
    }
}

/// Makes the file of a picture of levels: 1, 3 or 4 for each pixel, of 8 or 16 bits.
#[pyfunction]
pub(crate) fn levels_file(
    py: Python<'_>,
    width: u32,
    height: u32,
    channels: usize,
    bits: usize,
    levels: &Bound<'_, PyBytes>,
) -> PyResult<Given> {
    use ExtendedColorType::{L8, L16, Rgb8, Rgb16, Rgba8, Rgba16};
    let color = match (channels, bits) {
        (1, 8) => L8,
        (3, 8) => Rgb8,
        (4, 8) => Rgba8,
        (1, 16) => L16,
        (3, 16) => Rgb16,
        (4, 16) => Rgba16,
        _ => return Err(PyValueError::new_err(format!("{channels} channels of {bits} bits are no picture"))),
    };
    check_length(width, height, channels * bits / 8, levels)?;
    let levels = levels.as_bytes();
    let encode = || {
        let mut file = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive);
        if bits == 16 {
            // The encoder takes the order of the machine.
            let words = levels.as_chunks().0.iter().flat_map(|word| u16::from_le_bytes(*word).to_ne_bytes());
            let words: Vec<u8> = words.collect();
            encoder.write_image(&words, width, height, color)?;
        } else {
            encoder.write_image(levels, width, height, color)?;
        }
        Ok::<_, image::ImageError>(Given::new("picture", ".png", file))
    };
    py.detach(|| guarded(encode))?.map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Makes the file of a picture of light: red, green and blue of each pixel, of 32 bits.
#[pyfunction]
pub(crate) fn light_file(
    py: Python<'_>,
    width: u32,
    height: u32,
    light: &Bound<'_, PyBytes>,
) -> PyResult<Given> {
    check_length(width, height, 12, light)?;
    let light = light.as_bytes();
    py.detach(|| guarded(|| Given::new("picture", ".exr", exr(width, height, light))))
}

/// Returns an OpenEXR file without compression.
fn exr(width: u32, height: u32, light: &[u8]) -> Vec<u8> {
    let mut file = b"\x76\x2f\x31\x01\x02\0\0\0".to_vec();
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        for text in [name, kind] {
            file.extend_from_slice(text.as_bytes());
            file.push(0);
        }
        file.extend_from_slice(&(value.len() as u32).to_le_bytes());
        file.extend_from_slice(value);
    };
    let mut channels = Vec::new();
    for name in *b"BGR" {
        // Floats, of which there is one for each pixel.
        channels.extend_from_slice(&[name, 0, 2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
    }
    channels.push(0);
    let window: Vec<u8> = [0, 0, width - 1, height - 1].iter().flat_map(|edge| edge.to_le_bytes()).collect();
    attribute("channels", "chlist", &channels);
    attribute("compression", "compression", &[0]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1.0f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1.0f32.to_le_bytes());
    file.push(0);
    let of_row = 12 * width as usize;
    let first = file.len() + 8 * height as usize;
    for row in 0..height as usize {
        file.extend_from_slice(&((first + row * (of_row + 8)) as u64).to_le_bytes());
    }
    for (number, row) in (0u32..).zip(light.chunks_exact(of_row)) {
        file.extend_from_slice(&number.to_le_bytes());
        file.extend_from_slice(&(of_row as u32).to_le_bytes());
        for channel in [2, 1, 0] {
            let pixels = row.as_chunks::<12>().0.iter();
            file.extend(pixels.flat_map(|pixel| &pixel[4 * channel..4 * channel + 4]));
        }
    }
    file
}

fn check_length(width: u32, height: u32, of_pixel: usize, bytes: &Bound<'_, PyBytes>) -> PyResult<()> {
    let length = u64::from(width) * u64::from(height) * of_pixel as u64;
    if length == 0 || bytes.as_bytes().len() as u64 != length {
        return Err(PyValueError::new_err("the bytes are not those of such a picture"));
    }
    Ok(())
}

/// Returns the file for an array of pixels, made by `function` of `_arrays.py`, or `None` for any other value.
///
/// # Errors
/// Fails if the array is no picture.
pub(crate) fn picture_of(
    value: &Bound<'_, PyAny>,
    place: Place<'_>,
    function: &str,
) -> PyResult<Option<Given>> {
    let module = value.py().import("rayfold._arrays")?;
    let file = module.call_method1(function, (place.to_string(), value))?;
    Ok(file.cast::<Given>().ok().map(|file| file.get().clone()))
}
