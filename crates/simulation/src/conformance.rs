//! The suite that every store must pass. It panics with the rule that is broken.
//!
//! Run it on an empty prefix: `conformance::check(&store, "some-prefix").await`.

#![allow(
    clippy::unwrap_used,
    clippy::missing_panics_doc,
    reason = "this is a test that lives in the library"
)]

use bytes::Bytes;
use futures_util::future::join_all;

use rayfold_pipeline::Error;
use rayfold_pipeline::store::{
    ListPage, ListRequest, PAGE, Patch, PutOptions, Store, UnfinishedUpload, Upload,
};

/// Runs the whole suite below `prefix`, which must be empty; it leaves objects behind.
pub async fn check<S: Store>(store: &S, prefix: &str) {
    objects_come_back_as_they_were_put(store, prefix).await;
    keys_may_hold_any_text(store, prefix).await;
    ranges_are_parts_of_the_body(store, prefix).await;
    missing_objects_have_an_error_of_their_own(store, prefix).await;
    equal_bodies_have_equal_tags(store, prefix).await;
    if_absent_never_replaces(store, prefix).await;
    if_match_replaces_only_that_version(store, prefix).await;
    of_many_writers_one_wins(store, prefix).await;
    listings_are_sorted_and_complete(store, prefix).await;
    delimiters_roll_up(store, prefix).await;
    long_listings_go_on(store, prefix).await;
    long_listings_with_delimiter_go_on(store, prefix).await;
    uploads_appear_whole(store, prefix).await;
    uploads_keep_their_condition(store, prefix).await;
    uploads_are_left_and_taken_up(store, prefix).await;
    uploads_change_their_start_at_the_end(store, prefix).await;
    uploads_are_taken_up_twice_without_harm(store, prefix).await;
    uploads_that_are_gone_have_an_error_of_their_own(store, prefix).await;
}

/// Checks body, size, tag and metadata, by `get` and by `head`. A later put replaces them, and a delete removes them.
pub async fn objects_come_back_as_they_were_put<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/object");
    let options = PutOptions::always().content_type("text/plain").metadata("generation", "abc-1");
    let etag = store.put(&key, Bytes::from_static(b"body"), options).await.unwrap();
    let object = store.get(&key).await.unwrap();
    assert_eq!(object.body, "body");
    assert_eq!(object.info.size, 4);
    assert_eq!(object.info.etag, etag, "get and put agree on the tag");
    assert!(!etag.as_str().contains('"'), "tags are bare");
    assert_eq!(object.info.metadata.get("generation").map(String::as_str), Some("abc-1"));
    assert_eq!(store.head(&key).await.unwrap(), object.info, "head and get agree");
    store.put(&key, Bytes::new(), PutOptions::always()).await.unwrap();
    let object = store.get(&key).await.unwrap();
    assert!(object.body.is_empty() && object.info.metadata.is_empty(), "a put replaces all of the object");
    store.delete(&key).await.unwrap();
    assert!(store.get(&key).await.unwrap_err().is_not_found());
    store.delete(&key).await.expect("deleting what is not there is no error");
}

/// Checks keys with spaces, plus signs, umlauts, percent signs, slashes and ampersands, in put, get, list and delete.
pub async fn keys_may_hold_any_text<S: Store>(store: &S, prefix: &str) {
    let names =
        ["a b", "a+b", "ä/ö", "100%", "50%25", "x&y=z", "q?r#s", "it's", "deep/er/still", "日本@v-p1.png"];
    for name in names {
        let key = format!("{prefix}/text/{name}");
        store.put(&key, Bytes::from(name), PutOptions::if_absent()).await.unwrap();
        assert_eq!(store.get(&key).await.unwrap().body, name, "{name}");
        let page = store.list(ListRequest::all(key.clone())).await.unwrap();
        assert_eq!(page.objects.iter().map(|o| o.key.as_str()).collect::<Vec<_>>(), [key.as_str()], "{name}");
        store.delete(&key).await.unwrap();
        assert!(store.head(&key).await.unwrap_err().is_not_found(), "{name}");
    }
}

/// A range is cut at the object's end. The reported size is that of the whole object.
pub async fn ranges_are_parts_of_the_body<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/range");
    let etag = store.put(&key, Bytes::from_static(b"0123456789"), PutOptions::always()).await.unwrap();
    for (range, expected) in [(0..4, "0123"), (3..7, "3456"), (8..100, "89"), (0..100, "0123456789")] {
        let object = store.get_range(&key, range.clone()).await.unwrap();
        assert_eq!(object.body, expected, "{range:?}");
        assert_eq!((object.info.size, &object.info.etag), (10, &etag), "{range:?}");
    }
}

/// Checks that get, range, head and a put with `If-Match` fail with 404 and no other error.
pub async fn missing_objects_have_an_error_of_their_own<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/missing");
    let is_missing = |error: Error| matches!(error, Error::NotFound { key: named } if named == key);
    assert!(is_missing(store.get(&key).await.unwrap_err()));
    assert!(is_missing(store.get_range(&key, 0..10).await.unwrap_err()));
    assert!(is_missing(store.head(&key).await.unwrap_err()));
    let other = store.put(&format!("{prefix}/other"), Bytes::new(), PutOptions::always()).await.unwrap();
    let put = store.put(&key, Bytes::new(), PutOptions::if_match(other)).await;
    assert!(is_missing(put.unwrap_err()), "a put with If-Match on nothing answers 404");
}

/// The protocol relies on this: if a script is uploaded again unchanged, its tag stays the same.
pub async fn equal_bodies_have_equal_tags<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/tag");
    let first = store.put(&key, Bytes::from_static(b"one"), PutOptions::always()).await.unwrap();
    let second = store.put(&key, Bytes::from_static(b"two"), PutOptions::always()).await.unwrap();
    let third = store.put(&key, Bytes::from_static(b"one"), PutOptions::always()).await.unwrap();
    assert_ne!(first, second);
    assert_eq!(first, third);
    let page = store.list(ListRequest::all(key.clone())).await.unwrap();
    assert_eq!(page.objects[0].etag, third, "listings show the same tag");
}

/// The second put fails with 412, and the first object stays.
pub async fn if_absent_never_replaces<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/absent");
    store.put(&key, Bytes::from_static(b"first"), PutOptions::if_absent()).await.unwrap();
    let error = store.put(&key, Bytes::from_static(b"second"), PutOptions::if_absent()).await.unwrap_err();
    assert!(matches!(error, Error::PreconditionFailed { .. }), "{error:?}");
    assert_eq!(store.get(&key).await.unwrap().body, "first");
    store.delete(&key).await.unwrap();
    store.put(&key, Bytes::from_static(b"third"), PutOptions::if_absent()).await.expect("it is gone");
}

/// A put fails with 412 for an older version.
pub async fn if_match_replaces_only_that_version<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/match");
    let first = store.put(&key, Bytes::from_static(b"1"), PutOptions::always()).await.unwrap();
    let second =
        store.put(&key, Bytes::from_static(b"2"), PutOptions::if_match(first.clone())).await.unwrap();
    let error = store.put(&key, Bytes::from_static(b"3"), PutOptions::if_match(first)).await.unwrap_err();
    assert!(matches!(error, Error::PreconditionFailed { .. }), "{error:?}");
    assert_eq!(store.get(&key).await.unwrap().body, "2");
    store.put(&key, Bytes::from_static(b"4"), PutOptions::if_match(second)).await.unwrap();
}

/// Of concurrent puts, the losers get a conflict (409 or 412), and the object is the winner's.
pub async fn of_many_writers_one_wins<S: Store>(store: &S, prefix: &str) {
    let absent = format!("{prefix}/race-absent");
    let matched = format!("{prefix}/race-match");
    let etag = store.put(&matched, Bytes::from_static(b"start"), PutOptions::always()).await.unwrap();
    for (key, options) in [(absent, PutOptions::if_absent()), (matched, PutOptions::if_match(etag))] {
        let writers = (0..8).map(|writer| store.put(&key, Bytes::from(writer.to_string()), options.clone()));
        let answers = join_all(writers).await;
        let mut winners = Vec::new();
        for (writer, answer) in answers.into_iter().enumerate() {
            match answer {
                Ok(_) => winners.push(writer.to_string()),
                Err(error) => assert!(error.is_conflict(), "{error:?}"),
            }
        }
        assert_eq!(winners.len(), 1, "{key}");
        assert_eq!(store.get(&key).await.unwrap().body, winners[0]);
    }
}

/// Keys are in byte order, with size and prefix. The key `start_after` itself is excluded and need not exist.
pub async fn listings_are_sorted_and_complete<S: Store>(store: &S, prefix: &str) {
    let names = ["B", "a-b", "a/b", "aa", "b", "é", "z"];
    for name in names {
        let key = format!("{prefix}/sorted/{name}");
        store.put(&key, Bytes::from(name), PutOptions::always()).await.unwrap();
    }
    let all = ListRequest::all(format!("{prefix}/sorted/"));
    let page = store.list(all.clone()).await.unwrap();
    let shown = |page: &ListPage| -> Vec<String> {
        page.objects.iter().map(|o| o.key[prefix.len() + "/sorted/".len()..].to_owned()).collect()
    };
    assert_eq!(shown(&page), ["B", "a-b", "a/b", "aa", "b", "z", "é"]);
    assert_eq!(page.objects[1].size, 3);
    assert_eq!(page.next, None);
    for (after, expected) in
        [("a-b", vec!["a/b", "aa", "b", "z", "é"]), ("a.", vec!["a/b", "aa", "b", "z", "é"])]
    {
        let start_after = Some(format!("{prefix}/sorted/{after}"));
        let page = store.list(ListRequest { start_after, ..all.clone() }).await.unwrap();
        assert_eq!(shown(&page), expected, "{after}");
    }
    let nothing = store.list(ListRequest::all(format!("{prefix}/nothing/"))).await.unwrap();
    assert_eq!(nothing, ListPage::default());
}

/// Checks one entry per folder, with its closing slash.
pub async fn delimiters_roll_up<S: Store>(store: &S, prefix: &str) {
    for name in ["x/1", "x/2/3", "x/2/4", "x/5", "x/6/7", "y/8"] {
        store.put(&format!("{prefix}/rolled/{name}"), Bytes::new(), PutOptions::always()).await.unwrap();
    }
    let page = store.list(ListRequest::level(format!("{prefix}/rolled/x/"))).await.unwrap();
    let keys: Vec<_> = page.objects.iter().map(|object| object.key.clone()).collect();
    assert_eq!(keys, [format!("{prefix}/rolled/x/1"), format!("{prefix}/rolled/x/5")]);
    assert_eq!(page.prefixes, [format!("{prefix}/rolled/x/2/"), format!("{prefix}/rolled/x/6/")]);
}

/// Checks listings of more than a page, also from `start_after` on.
pub async fn long_listings_go_on<S: Store>(store: &S, prefix: &str) {
    let key = |n: usize| format!("{prefix}/long/{n:05}");
    let count = PAGE + 5;
    for chunk in (0..count).collect::<Vec<_>>().chunks(50) {
        join_all(chunk.iter().map(|n| async {
            store.put(&key(*n), Bytes::new(), PutOptions::always()).await.unwrap();
        }))
        .await;
    }
    let all = ListRequest::all(format!("{prefix}/long/"));
    assert_eq!(follow(store, all.clone()).await.0, (0..count).map(key).collect::<Vec<_>>());
    let start_after = Some(key(2));
    let rest = follow(store, ListRequest { start_after, ..all }).await.0;
    assert_eq!(rest, (3..count).map(key).collect::<Vec<_>>());
}

/// A page may end with a folder, which must be listed exactly once.
pub async fn long_listings_with_delimiter_go_on<S: Store>(store: &S, prefix: &str) {
    let folder = |n: usize| format!("{prefix}/folders/{n:05}/");
    let count = PAGE + 5;
    for chunk in (0..count).collect::<Vec<_>>().chunks(50) {
        join_all(chunk.iter().map(|n| async {
            for name in ["a", "b"] {
                store
                    .put(&format!("{}{name}", folder(*n)), Bytes::new(), PutOptions::always())
                    .await
                    .unwrap();
            }
        }))
        .await;
    }
    let (objects, folders) = follow(store, ListRequest::level(format!("{prefix}/folders/"))).await;
    assert!(objects.is_empty());
    assert_eq!(folders, (0..count).map(folder).collect::<Vec<_>>());
}

/// An upload is invisible until it is finished, then equal byte for byte, and invisible if it is aborted. Tested with
/// pieces of all sizes and several parts.
pub async fn uploads_appear_whole<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/upload");
    let body: Vec<u8> = (0..13_000_000_u32).map(|n| (n % 251) as u8).collect();
    let options = PutOptions::if_absent().content_type("image/gif").metadata("generation", "g");
    let mut upload = store.upload(&key, options.clone()).await.unwrap();
    let mut rest = &body[..];
    for size in [0, 1, 1000, 6_000_000, 17, 4_000_000].into_iter().chain(std::iter::repeat(500_000)) {
        let (piece, after) = rest.split_at(size.min(rest.len()));
        upload.write(Bytes::copy_from_slice(piece)).await.unwrap();
        rest = after;
        if rest.is_empty() {
            break;
        }
    }
    assert!(store.head(&key).await.unwrap_err().is_not_found(), "nothing is visible before the end");
    let etag = upload.finish(None).await.unwrap();
    let object = store.get(&key).await.unwrap();
    assert!(object.body == body, "the body comes back");
    assert_eq!(object.info.etag, etag);
    assert_eq!(object.info.metadata.get("generation").map(String::as_str), Some("g"));

    let small = format!("{prefix}/upload-small");
    for pieces in [vec![], vec!["small"]] {
        let mut upload = store.upload(&small, PutOptions::always()).await.unwrap();
        for piece in &pieces {
            upload.write(Bytes::from_static(piece.as_bytes())).await.unwrap();
        }
        upload.finish(None).await.unwrap();
        assert_eq!(store.get(&small).await.unwrap().body, pieces.concat());
    }

    let aborted = format!("{prefix}/upload-aborted");
    let mut upload = store.upload(&aborted, options).await.unwrap();
    upload.write(Bytes::from(vec![7; 6_000_000])).await.unwrap();
    upload.abort().await.unwrap();
    assert!(store.head(&aborted).await.unwrap_err().is_not_found());
}

/// The condition is evaluated when the upload is finished, not when it is begun.
pub async fn uploads_keep_their_condition<S: Store>(store: &S, prefix: &str) {
    for size in [10, 6_000_000] {
        let key = format!("{prefix}/upload-condition-{size}");
        let piece = || Bytes::from(vec![1; size]);

        let mut late = store.upload(&key, PutOptions::if_absent()).await.unwrap();
        late.write(piece()).await.unwrap();
        let first = store.put(&key, Bytes::from_static(b"first"), PutOptions::always()).await.unwrap();
        assert!(late.finish(None).await.unwrap_err().is_conflict(), "someone was first");
        assert_eq!(store.get(&key).await.unwrap().body, "first");

        let mut stale = store.upload(&key, PutOptions::if_match(first.clone())).await.unwrap();
        stale.write(piece()).await.unwrap();
        let second = store.put(&key, Bytes::from_static(b"second"), PutOptions::always()).await.unwrap();
        assert!(stale.finish(None).await.unwrap_err().is_conflict(), "the version is another");

        let mut good = store.upload(&key, PutOptions::if_match(second.clone())).await.unwrap();
        good.write(piece()).await.unwrap();
        good.finish(None).await.unwrap();
        assert_eq!(store.get(&key).await.unwrap().body, piece());

        let mut orphan = store.upload(&key, PutOptions::if_match(second)).await.unwrap();
        orphan.write(piece()).await.unwrap();
        store.delete(&key).await.unwrap();
        let error = orphan.finish(None).await.unwrap_err();
        assert!(error.is_not_found() || error.is_conflict(), "the object is gone: {error:?}");
        assert!(store.head(&key).await.unwrap_err().is_not_found());
    }
}

/// An upload is left after any number of bytes, and resumed from values that a process can store. The body is the same,
/// and the condition still holds.
pub async fn uploads_are_left_and_taken_up<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/upload-left");
    let body: Vec<u8> = (0..26_000_000_u32).map(|n| (n % 253) as u8).collect();
    let options = PutOptions::if_absent().content_type("image/gif").metadata("generation", "g");
    let mut upload = store.upload(&key, options.clone()).await.unwrap();
    let mut rest = &body[..];
    for size in [0, 10, 9_000_000, 0, 8_000_000, 500_000, 20_000_000] {
        let (piece, after) = rest.split_at(size.min(rest.len()));
        upload.write(Bytes::copy_from_slice(piece)).await.unwrap();
        rest = after;
        upload = store.take_up(&key, options.clone(), written_down(upload.leave()));
    }
    assert!(rest.is_empty() && store.head(&key).await.unwrap_err().is_not_found(), "nothing is visible yet");
    let etag = upload.finish(None).await.unwrap();
    let object = store.get(&key).await.unwrap();
    assert!(object.body == body, "the body comes back");
    assert_eq!(
        (object.info.etag, object.info.metadata.get("generation").map(String::as_str)),
        (etag, Some("g"))
    );

    for size in [10, 9_000_000] {
        let mut late = store.upload(&key, PutOptions::if_absent()).await.unwrap();
        late.write(Bytes::from(vec![1; size])).await.unwrap();
        let late = store.take_up(&key, PutOptions::if_absent(), written_down(late.leave()));
        assert!(late.finish(None).await.unwrap_err().is_conflict(), "there is one already");
    }
}

/// This holds for any length of the object, and wherever the upload was left.
pub async fn uploads_change_their_start_at_the_end<S: Store>(store: &S, prefix: &str) {
    let options = PutOptions::if_absent().start_last();
    for (name, pieces) in [
        ("empty", vec![]),
        ("short", vec![8]),
        ("piece", vec![9_000_000]),
        ("pieces", vec![10, 9_000_000, 8_000_000, 500_000, 9_000_000]),
    ] {
        let key = format!("{prefix}/upload-start-{name}");
        let mut upload = store.upload(&key, options.clone()).await.unwrap();
        let mut expected = Vec::new();
        for (number, size) in pieces.into_iter().enumerate() {
            let piece: Vec<u8> = (0..size).map(|n| (n % 249) as u8 ^ number as u8).collect();
            expected.extend_from_slice(&piece);
            upload.write(piece.into()).await.unwrap();
            upload = store.take_up(&key, options.clone(), written_down(upload.leave()));
        }
        let patch = Patch { at: 4, bytes: Bytes::from_static(b"size") };
        patch.apply(&mut expected);
        assert!(expected.get(4..8).is_none_or(|bytes| bytes == b"size"));
        upload.finish(Some(patch)).await.unwrap();
        assert!(store.get(&key).await.unwrap().body == expected, "{name}");
    }
}

/// Two processes continue from the same place with the same bytes. One of them finishes, and the object is complete.
pub async fn uploads_are_taken_up_twice_without_harm<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/upload-twice");
    let piece = |byte: u8| Bytes::from(vec![byte; 9_000_000]);
    let mut upload = store.upload(&key, PutOptions::if_absent()).await.unwrap();
    upload.write(piece(1)).await.unwrap();
    let left = upload.leave();
    let mut first = store.take_up(&key, PutOptions::if_absent(), left.clone());
    let mut second = store.take_up(&key, PutOptions::if_absent(), left);
    first.write(piece(2)).await.unwrap();
    second.write(piece(2)).await.unwrap();
    first.finish(None).await.unwrap();
    let error = second.finish(None).await.unwrap_err();
    assert!(error.is_conflict() || error.is_ambiguous() || error.is_not_found(), "{error:?}");
    assert!(store.get(&key).await.unwrap().body == [piece(1), piece(2)].concat());
}

/// The writer that resumed the upload aborts it. The other writer gets the error at its next part, or at its end.
pub async fn uploads_that_are_gone_have_an_error_of_their_own<S: Store>(store: &S, prefix: &str) {
    let key = format!("{prefix}/upload-gone");
    let piece = || Bytes::from(vec![1; 9_000_000]);
    let mut upload = store.upload(&key, PutOptions::always()).await.unwrap();
    upload.write(piece()).await.unwrap();
    let left = upload.leave();
    store.take_up(&key, PutOptions::always(), left.clone()).abort().await.unwrap();
    let mut late = store.take_up(&key, PutOptions::always(), left.clone());
    assert!(late.write(piece()).await.unwrap_err().is_not_found());
    let error = store.take_up(&key, PutOptions::always(), left.clone()).finish(None).await.unwrap_err();
    assert!(error.is_ambiguous() || error.is_not_found(), "{error:?}");
    store.take_up(&key, PutOptions::always(), left).abort().await.expect("it may be gone");
    assert!(store.head(&key).await.unwrap_err().is_not_found());
}

/// Returns the unfinished upload as another process reads it.
fn written_down(unfinished: UnfinishedUpload) -> UnfinishedUpload {
    let text = serde_json::to_string(&unfinished).unwrap();
    let UnfinishedUpload { start, tail, .. } = unfinished;
    UnfinishedUpload { start, tail, ..serde_json::from_str(&text).unwrap() }
}

/// Returns all keys and folders of a listing, read page by page.
async fn follow<S: Store>(store: &S, mut request: ListRequest) -> (Vec<String>, Vec<String>) {
    let (mut keys, mut folders) = (Vec::new(), Vec::new());
    loop {
        let page = store.list(request.clone()).await.unwrap();
        assert!(page.objects.len() + page.prefixes.len() <= PAGE);
        keys.extend(page.objects.into_iter().map(|object| object.key));
        folders.extend(page.prefixes);
        match page.next {
            Some(next) => request.continuation = Some(next),
            None => return (keys, folders),
        }
    }
}
