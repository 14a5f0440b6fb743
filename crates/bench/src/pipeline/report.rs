//! The page: our times beside the paper's, and their parts.

use std::fmt::Write as _;

use anyhow::Result;
use rayfold_local::StoreKind;
use rayfold_local::routes::Function;

use super::{AT_ONCE, Run, Scene};

pub(super) fn text(store: StoreKind, scenes: &[Scene], load: &str, plot: &str) -> Result<String> {
    let mut page = String::new();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let (flag, other, of_store) = match store {
        StoreKind::BuiltIn => ("", " ([on MinIO](pipeline-minio.md))", "The store"),
        StoreKind::Minio => (" --store minio", " ([on the built-in store](pipeline.md))", "MinIO"),
        StoreKind::SeaweedFs => {
            (" --store seaweedfs", " ([on the built-in store](pipeline.md))", "SeaweedFS")
        }
    };
    writeln!(
        page,
        "# Pipeline on {store}\n\n\
         Written by `cargo run --release -p rayfold-bench -- pipeline{flag}`{other}; all figures are from one run, on \
         {threads} processors. The load at its start was {load} (`/proc/loadavg`); other programs on the machine \
         affect every time below.\n\n\
         {of_store}, the local invoker, the uploads and the functions share the machine. The paper's seconds are from \
         its figure 4: up to ten ray tracers, each on its own machine, with images of 1024 x 1024 and another \
         renderer. Our scenes have the names, object counts and frame counts of the paper. The rows can therefore be \
         compared, but their ratios have no meaning.\n\n\
         ## Seconds from the first upload to the GIF\n\n\
         *Cloud*: the assemble function makes the GIF. *Local*: the client fetches the frames and makes the GIF. Both \
         have warm processes. *Cold*: like cloud, with new processes. *Sequential*: every frame is drawn on one \
         thread, one after the other, without a GIF.\n"
    )?;
    let mut head = "| scene | objects | frames |".to_owned();
    for at_once in AT_ONCE {
        write!(head, " {at_once}: local | paper | {at_once}: cloud | paper | {at_once}: cold |")?;
    }
    writeln!(page, "{head} sequential | paper |")?;
    writeln!(page, "|{}", " --- |".repeat(head.matches('|').count() + 1))?;
    for scene in scenes {
        write!(
            page,
            "| {} | {:.0} | {} |",
            scene.folder.name,
            scene.folder.objects(),
            scene.folder.frames()
        )?;
        for (place, runs) in scene.runs.iter().enumerate() {
            let paper = [scene.paper[place * 2], scene.paper[place * 2 + 1]].map(seconds_of_paper);
            let [local, cloud, cold] =
                [&runs.local, &runs.warm, &runs.cold].map(|run| format!("{:.2}", run.total.as_secs_f64()));
            write!(page, " {local} | {} | {cloud} | {} | {cold} |", paper[0], paper[1])?;
        }
        writeln!(page, " {:.2} | {} |", scene.sequential.as_secs_f64(), seconds_of_paper(scene.paper[4]))?;
    }
    writeln!(
        page,
        "\n\
         ## The stages of a frame\n\n\
         Means over the frames in milliseconds, from the render function's log. *GIF* is the time to build the whole \
         GIF. *After upload* is the time in seconds from the last upload to the GIF.\n\n\
         | scene | at once | run | read | draw | put | fold | GIF | after upload |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    each(scenes, |scene, at_once, label, run| {
        let [read, draw, put, fold] = run.stages;
        let (gif, after) = (run.building.as_millis(), run.after_upload.as_secs_f64());
        writeln!(
            page,
            "| {scene} | {at_once} | {label} | {read:.1} | {draw:.1} | {put:.1} | {fold:.1} | {gif} | {after:.2} |"
        )
        .map_err(Into::into)
    })?;
    writeln!(
        page,
        "\n\
         ## Requests per frame, and cold starts\n\n\
         Requests are counted between each process and the store. *Billed* are the requests that S3 charges for (all \
         except DELETE), of both functions together. They include the assembler's read of each frame.\n\n\
         | scene | at once | run | render: GET | PUT | LIST | assemble: GET | PUT | LIST | billed per frame | cold \
         starts | mean ms to the first `next` |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    each(scenes, |scene, at_once, label, run| {
        let frames = scenes.iter().find(|s| s.folder.name == scene).map_or(1, |s| s.folder.frames()) as f64;
        let of = |function| run.requests.get(&function).copied().unwrap_or_default();
        let (render, assemble) = (of(Function::Render), of(Function::Assemble));
        let billed = (render.billed() + assemble.billed()) as f64 / frames;
        let cells = [render.get, render.put, render.list, assemble.get, assemble.put, assemble.list]
            .map(|count| format!("{:.2}", count as f64 / frames))
            .join(" | ");
        let (starts, init) = (run.cold_starts, run.init.as_secs_f64() * 1e3);
        writeln!(page, "| {scene} | {at_once} | {label} | {cells} | {billed:.2} | {starts} | {init:.1} |")
            .map_err(Into::into)
    })?;
    writeln!(page, "\n## Timeline\n\n![one row per process, one bar per invocation]({plot})")?;
    writeln!(page, "\nBlue is the render function, orange the assemble function.")?;
    Ok(page)
}

fn each(scenes: &[Scene], mut row: impl FnMut(&str, usize, &str, &Run) -> Result<()>) -> Result<()> {
    for scene in scenes {
        for (runs, at_once) in scene.runs.iter().zip(AT_ONCE) {
            for (label, run) in [("cold", &runs.cold), ("warm", &runs.warm), ("local", &runs.local)] {
                row(&scene.folder.name, at_once, label, run)?;
            }
        }
    }
    Ok(())
}

fn seconds_of_paper(seconds: Option<f64>) -> String {
    seconds.map_or("timeout".to_owned(), |seconds| format!("{seconds:.2}"))
}
