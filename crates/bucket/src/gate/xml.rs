//! The elements of an XML body. `s3s` ignores unknown elements, and CDATA.

use quick_xml::Reader;
use quick_xml::events::Event;
use s3s::{S3Result, s3_error};

use super::operations::Operation;
use crate::answer::not_implemented;

/// Checks that an operation allows every element, by its path of names.
pub(super) fn check(operation: &Operation, known: &[&str], body: &[u8]) -> S3Result<()> {
    let malformed = || s3_error!(MalformedXML, "The XML you provided was not well-formed");
    let mut reader = Reader::from_reader(body);
    let mut path: Vec<String> = Vec::new();
    loop {
        let event = reader.read_event().map_err(|_| malformed())?;
        let (start, is_empty) = match event {
            Event::Start(start) => (start, false),
            Event::Empty(start) => (start, true),
            Event::End(_) => {
                path.pop();
                continue;
            }
            Event::CData(_) => return Err(not_implemented("a CDATA section")),
            Event::DocType(_) => return Err(not_implemented("a document type")),
            Event::Eof => return Ok(()),
            Event::Text(_) | Event::GeneralRef(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_) => {
                continue;
            }
        };
        path.push(String::from_utf8_lossy(start.name().as_ref()).into_owned());
        // `s3s` checks the root element.
        let inside = path.get(1..).unwrap_or_default().join("/");
        if !inside.is_empty() && !known.contains(&inside.as_str()) {
            return Err(not_implemented(&format!("the element {inside} of {}", operation.name)));
        }
        if is_empty {
            path.pop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::operations::{OPERATIONS, Payload};
    use super::*;

    fn code(operation: &str, body: &str) -> String {
        let operation = OPERATIONS.iter().find(|known| known.name == operation).unwrap();
        let Payload::Xml(known) = operation.payload else { panic!("{operation:?}") };
        match check(operation, known, body.as_bytes()) {
            Ok(()) => "ok".to_owned(),
            Err(error) => error.code().as_str().to_owned(),
        }
    }

    #[test]
    fn elements_that_are_not_known_are_refused() {
        let delete = |inside: &str| code("DeleteObjects", &format!("<Delete>{inside}</Delete>"));
        assert_eq!(delete("<Object><Key>a&#13;b</Key></Object><Quiet/>"), "ok");
        assert_eq!(delete("<Object><Key>a</Key><Size>1</Size></Object>"), "NotImplemented");
        assert_eq!(delete("<Object><Key>a<![CDATA[b]]></Key></Object>"), "NotImplemented");
        assert_eq!(delete("<Key/>"), "NotImplemented");
        assert_eq!(delete("<Object><Key>a</Object></Key>"), "MalformedXML");
        let part = |sum: &str| {
            let part = format!("<Part><PartNumber>1</PartNumber><Checksum{sum}>A</Checksum{sum}></Part>");
            code("CompleteMultipartUpload", &format!("<A>{part}</A>"))
        };
        assert_eq!(part("CRC32"), "ok");
        for sum in ["SHA512", "MD5", "XXHASH64", "XXHASH3", "XXHASH128"] {
            assert_eq!(part(sum), "NotImplemented", "{sum}");
        }
    }
}
