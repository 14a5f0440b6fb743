//! Tests of multipart uploads.

use aws_sdk_s3::types::{
    ChecksumAlgorithm, ChecksumMode, ChecksumType, CompletedMultipartUpload, CompletedPart, ObjectAttributes,
};

use crate::stage::{BUCKET, Stage, failure, stage};

const PART: usize = 5 * 1024 * 1024;

async fn begin(stage: &Stage, key: &str) -> String {
    let begun = stage.client.create_multipart_upload().bucket(BUCKET).key(key);
    begun.metadata("colour", "red").send().await.unwrap().upload_id.unwrap()
}

async fn upload(stage: &Stage, key: &str, id: &str, number: i32, body: Vec<u8>) -> CompletedPart {
    let part = stage.client.upload_part().bucket(BUCKET).key(key).upload_id(id).part_number(number);
    let etag = part.body(body.into()).send().await.unwrap().e_tag;
    CompletedPart::builder().part_number(number).set_e_tag(etag).build()
}

fn list(parts: &[CompletedPart]) -> CompletedMultipartUpload {
    CompletedMultipartUpload::builder().set_parts(Some(parts.to_vec())).build()
}

#[tokio::test]
async fn parts_become_one_object() {
    let stage = stage().await;
    let id = begin(&stage, "film").await;
    let bodies = [vec![1; PART], vec![2; PART + 1], b"the end".to_vec()];
    let mut parts = Vec::new();
    // The parts arrive out of order, one of them twice, one without need.
    upload(&stage, "film", &id, 9, vec![9; PART]).await;
    upload(&stage, "film", &id, 2, vec![0; PART]).await;
    for number in [2, 1, 3] {
        let part = upload(&stage, "film", &id, number, bodies[usize::try_from(number).unwrap() - 1].clone());
        parts.push(part.await);
    }
    parts.sort_by_key(|part| part.part_number);
    let listed = stage
        .client
        .list_parts()
        .bucket(BUCKET)
        .key("film")
        .upload_id(&id)
        .max_parts(2)
        .send()
        .await
        .unwrap();
    assert_eq!(listed.parts().iter().map(|part| part.part_number.unwrap()).collect::<Vec<_>>(), [1, 2]);
    assert_eq!((listed.is_truncated, listed.next_part_number_marker.as_deref()), (Some(true), Some("2")));
    let uploads = stage.client.list_multipart_uploads().bucket(BUCKET).send().await.unwrap();
    assert_eq!(uploads.uploads()[0].upload_id(), Some(id.as_str()));

    let complete = stage.client.complete_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
    let completed = complete.multipart_upload(list(&parts)).send().await.unwrap();
    assert!(completed.location.unwrap().ends_with("/films/film"));
    let etag = completed.e_tag.unwrap();
    assert!(etag.ends_with("-3\""), "{etag}");
    let whole = bodies.concat();
    assert!(stage.get("film").await == whole);
    let head = stage.client.head_object().bucket(BUCKET).key("film").send().await.unwrap();
    assert_eq!(head.metadata.unwrap()["colour"], "red");
    assert_eq!(head.content_length, i64::try_from(whole.len()).ok());

    let across = PART - 10..2 * PART + 5;
    let range = format!("bytes={}-{}", across.start, across.end - 1);
    let got = stage.client.get_object().bucket(BUCKET).key("film").range(range).send().await.unwrap();
    assert!(got.body.collect().await.unwrap().to_vec() == whole[across]);
    let second = stage.client.get_object().bucket(BUCKET).key("film").part_number(2).send().await.unwrap();
    assert_eq!(second.parts_count, Some(3));
    assert!(second.body.collect().await.unwrap().to_vec() == bodies[1]);
    let beyond = stage.client.get_object().bucket(BUCKET).key("film").part_number(4).send().await;
    assert_eq!(failure(beyond).0, 416);
    let asked = stage.client.get_object_attributes().bucket(BUCKET).key("film");
    let attributes = asked.object_attributes(ObjectAttributes::ObjectParts).send().await.unwrap();
    assert_eq!(attributes.object_parts.unwrap().total_parts_count, Some(3));

    assert_eq!(stage.files(), 2, "the part that was overwritten and the one for nothing are gone");
    assert!(stage.client.list_multipart_uploads().bucket(BUCKET).send().await.unwrap().uploads().is_empty());
    let again = || {
        let again = stage.client.complete_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
        again.multipart_upload(list(&parts))
    };
    let etag_again = again().send().await.unwrap().e_tag.unwrap();
    assert_eq!(etag_again, etag, "an answer that was lost can be asked for again");
    stage.put("film", "another").await;
    assert_eq!(failure(again().send().await), (404, "NoSuchUpload".into()), "what came after it stays");
    stage.client.delete_object().bucket(BUCKET).key("film").send().await.unwrap();
    assert_eq!(stage.files(), 0);
}

#[tokio::test]
async fn what_is_wrong_with_a_list_of_parts_is_said() {
    let stage = stage().await;
    let id = begin(&stage, "film").await;
    let small = upload(&stage, "film", &id, 1, vec![1; PART - 1]).await;
    let end = upload(&stage, "film", &id, 2, vec![2; 10]).await;
    let complete = |parts: &[CompletedPart]| {
        let complete = stage.client.complete_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
        complete.multipart_upload(list(parts))
    };
    let both = [small.clone(), end.clone()];
    assert_eq!(failure(complete(&both).send().await), (400, "EntityTooSmall".into()));
    assert_eq!(failure(complete(&[end.clone(), small]).send().await), (400, "InvalidPartOrder".into()));
    let wrong = CompletedPart::builder().part_number(2).e_tag("\"0\"").build();
    assert_eq!(failure(complete(&[wrong]).send().await), (400, "InvalidPart".into()));
    let missing = CompletedPart::builder().part_number(3).set_e_tag(end.e_tag.clone()).build();
    assert_eq!(failure(complete(&[missing]).send().await), (400, "InvalidPart".into()));
    assert_eq!(failure(complete(&[]).send().await), (400, "MalformedXML".into()));
    let beyond = stage.client.upload_part().bucket(BUCKET).key("film").upload_id(&id).part_number(10_001);
    assert_eq!(failure(beyond.send().await), (400, "InvalidArgument".into()));
    complete(&[end]).send().await.unwrap();
}

#[tokio::test]
async fn completion_is_conditional_and_can_be_tried_again() {
    let stage = stage().await;
    let etag = stage.put("film", "there").await;
    let id = begin(&stage, "film").await;
    let part = upload(&stage, "film", &id, 1, b"new".to_vec()).await;
    let complete = || {
        let complete = stage.client.complete_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
        complete.multipart_upload(list(std::slice::from_ref(&part)))
    };
    assert_eq!(failure(complete().if_none_match("*").send().await), (412, "PreconditionFailed".into()));
    assert_eq!(failure(complete().if_match("\"0\"").send().await), (412, "PreconditionFailed".into()));
    assert_eq!(stage.get("film").await, b"there");
    complete().if_match(etag).send().await.unwrap();
    assert_eq!(stage.get("film").await, b"new");
}

#[tokio::test]
async fn an_upload_that_is_aborted_leaves_nothing() {
    let stage = stage().await;
    let id = begin(&stage, "film").await;
    upload(&stage, "film", &id, 1, vec![1; 500_000]).await;
    assert_eq!(stage.files(), 1);
    let abort = || stage.client.abort_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
    abort().send().await.unwrap();
    assert_eq!(stage.files(), 0);
    assert_eq!(failure(abort().send().await), (404, "NoSuchUpload".into()));
    let late = stage.client.upload_part().bucket(BUCKET).key("film").upload_id(&id).part_number(1);
    assert_eq!(failure(late.body(vec![1; 500_000].into()).send().await), (404, "NoSuchUpload".into()));
    assert_eq!(stage.files(), 0);
    // Deleting a bucket also deletes its unfinished uploads.
    let id = begin(&stage, "film").await;
    upload(&stage, "film", &id, 1, vec![1; 500_000]).await;
    stage.client.delete_bucket().bucket(BUCKET).send().await.unwrap();
    assert_eq!(stage.files(), 0);
}

#[tokio::test]
async fn parts_are_copied_with_and_without_a_range() {
    let stage = stage().await;
    let source: Vec<u8> = (0..3_000_000_u32).flat_map(u32::to_le_bytes).collect();
    stage.put("source", source.clone()).await;
    let id = begin(&stage, "film").await;
    let copy = |number: i32, range: Option<String>| {
        let copy = stage.client.upload_part_copy().bucket(BUCKET).key("film").upload_id(&id);
        copy.part_number(number).copy_source(format!("{BUCKET}/source")).set_copy_source_range(range)
    };
    let whole = copy(1, None).send().await.unwrap().copy_part_result.unwrap();
    let last = copy(2, Some("bytes=100-199".into())).send().await.unwrap().copy_part_result.unwrap();
    let beyond = copy(3, Some(format!("bytes=0-{}", source.len())));
    assert_eq!(failure(beyond.send().await), (400, "InvalidArgument".into()));
    let parts = [(1, whole.e_tag), (2, last.e_tag)]
        .map(|(number, etag)| CompletedPart::builder().part_number(number).set_e_tag(etag).build());
    let complete = stage.client.complete_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
    complete.multipart_upload(list(&parts)).send().await.unwrap();
    assert!(stage.get("film").await == [&source[..], &source[100..200]].concat());
}

#[tokio::test]
async fn checksums_of_the_whole_are_of_the_kind_that_was_asked_for() {
    let stage = stage().await;
    let bodies = [vec![1; PART], b"the end".to_vec()];
    let whole = stage.client.put_object().bucket(BUCKET).key("whole").body(bodies.concat().into());
    let crc =
        whole.checksum_algorithm(ChecksumAlgorithm::Crc32).send().await.unwrap().checksum_crc32.unwrap();
    for (kind, expected) in [(ChecksumType::FullObject, Some(crc)), (ChecksumType::Composite, None)] {
        let begun = stage.client.create_multipart_upload().bucket(BUCKET).key("film");
        let begun = begun.checksum_algorithm(ChecksumAlgorithm::Crc32).checksum_type(kind.clone());
        let id = begun.send().await.unwrap().upload_id.unwrap();
        let mut parts = Vec::new();
        for (number, body) in (1..).zip(bodies.clone()) {
            let part =
                stage.client.upload_part().bucket(BUCKET).key("film").upload_id(&id).part_number(number);
            let part =
                part.checksum_algorithm(ChecksumAlgorithm::Crc32).body(body.into()).send().await.unwrap();
            let sum = part.checksum_crc32.clone();
            let listed = CompletedPart::builder().part_number(number).set_e_tag(part.e_tag);
            parts.push(listed.set_checksum_crc32(sum).build());
        }
        let complete = stage.client.complete_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
        let completed = complete.multipart_upload(list(&parts)).send().await.unwrap();
        assert_eq!(completed.checksum_type.as_ref(), Some(&kind));
        let got = stage.client.get_object().bucket(BUCKET).key("film").checksum_mode(ChecksumMode::Enabled);
        let got = got.send().await.unwrap();
        assert_eq!(got.checksum_crc32, completed.checksum_crc32);
        match expected {
            Some(crc) => assert_eq!(got.checksum_crc32, Some(crc)),
            None => assert!(got.checksum_crc32.unwrap().ends_with("-2")),
        }
    }
    let odd = stage.client.create_multipart_upload().bucket(BUCKET).key("film");
    let odd = odd.checksum_algorithm(ChecksumAlgorithm::Sha256).checksum_type(ChecksumType::FullObject);
    assert_eq!(failure(odd.send().await), (400, "InvalidRequest".into()));
}
