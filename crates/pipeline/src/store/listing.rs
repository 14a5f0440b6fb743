//! Reading a listing to its end. Pages are joined only here.

use std::future::Future;

use super::{ListPage, ListRequest, Listed};
use crate::Result;

/// All pages of a listing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Listing {
    /// Objects, in the byte order of their keys.
    pub objects: Vec<Listed>,
    /// Rolled-up prefixes with their closing `/`, in byte order.
    pub prefixes: Vec<String>,
}

impl Listing {
    /// Reads page by page with `page`, up to and including `end`, or to the listing's end without one.
    ///
    /// # Errors
    ///
    /// The first error of `page`.
    pub async fn read<F>(
        mut request: ListRequest,
        end: Option<&str>,
        page: impl Fn(ListRequest) -> F,
    ) -> Result<Self>
    where
        F: Future<Output = Result<ListPage>>,
    {
        let is_beyond = |key: &str| end.is_some_and(|end| key > end);
        let mut listing = Listing::default();
        loop {
            let ListPage { objects, prefixes, next } = page(request.clone()).await?;
            let last = objects.last().map(|object| object.key.as_str());
            let last = last.max(prefixes.last().map(String::as_str));
            let is_at_end = last.is_some_and(|last| end.is_some_and(|end| last >= end));
            listing.objects.extend(objects.into_iter().filter(|object| !is_beyond(&object.key)));
            listing.prefixes.extend(prefixes.into_iter().filter(|prefix| !is_beyond(prefix)));
            match next {
                Some(next) if !is_at_end => request.continuation = Some(next),
                _ => return Ok(listing),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use crate::Timestamp;
    use crate::store::{Bucket, PAGE, PutOptions};

    fn bucket(objects: usize) -> Bucket {
        let mut bucket = Bucket::default();
        for number in 0..objects {
            let key = format!("a/{number:05}");
            bucket.put(Timestamp(0), &key, "x".into(), PutOptions::always()).unwrap();
        }
        bucket
    }

    /// Returns the number of objects, the last of them, and the number of requests.
    async fn read(bucket: &Bucket, end: Option<&str>) -> (usize, Option<String>, u32) {
        let requests = Mutex::new(0);
        let page = |request| {
            *requests.lock().unwrap() += 1;
            std::future::ready(Ok(bucket.list(&request)))
        };
        let listing = Listing::read(ListRequest::all("a/"), end, page).await.unwrap();
        let last = listing.objects.last().map(|object| object.key.clone());
        (listing.objects.len(), last, requests.into_inner().unwrap())
    }

    #[tokio::test]
    async fn a_listing_has_all_its_pages() {
        assert_eq!(read(&bucket(0), None).await, (0, None, 1));
        let bucket = bucket(2 * PAGE + 1);
        assert_eq!(read(&bucket, None).await, (2001, Some("a/02000".into()), 3));
    }

    #[tokio::test]
    async fn a_listing_ends_with_its_end() {
        let bucket = bucket(2 * PAGE + 1);
        assert_eq!(read(&bucket, Some("a/00006")).await, (7, Some("a/00006".into()), 1));
        assert_eq!(read(&bucket, Some("a/00999")).await, (1000, Some("a/00999".into()), 1));
        assert_eq!(read(&bucket, Some("a/01000")).await, (1001, Some("a/01000".into()), 2));
        assert_eq!(read(&bucket, Some("b")).await, (2001, Some("a/02000".into()), 3));
    }

    #[tokio::test]
    async fn folders_beyond_the_end_are_left_out() {
        let mut bucket = Bucket::default();
        for key in ["a/1/x", "a/2/x", "a/3/x"] {
            bucket.put(Timestamp(0), key, "x".into(), PutOptions::always()).unwrap();
        }
        let page = |request| std::future::ready(Ok(bucket.list(&request)));
        let listing = Listing::read(ListRequest::level("a/"), Some("a/2/"), page).await.unwrap();
        assert_eq!(listing.prefixes, ["a/1/", "a/2/"]);
    }
}
