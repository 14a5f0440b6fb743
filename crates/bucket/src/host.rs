//! The bucket in a host name: `bucket.localhost:9000` and `bucket.s3.localhost:9000` name a bucket. For any other
//! host, the bucket is the first part of the path.

use std::net::{IpAddr, SocketAddr};

use hyper::HeaderMap;
use hyper::header::HOST;
use s3s::S3Result;
use s3s::host::{S3Host, VirtualHost};

/// The endings of host names that contain a bucket, the longer one first.
const BASES: [&str; 2] = ["s3.localhost", "localhost"];

/// The parser of host names, see the module.
pub(crate) struct Hosts;

impl S3Host for Hosts {
    fn parse_host_header<'a>(&'a self, host: &'a str) -> S3Result<VirtualHost<'a>> {
        let name = host.rsplit_once(':').map_or(host, |(name, _)| name);
        for base in BASES {
            if name == base {
                break;
            }
            if let Some(bucket) = name.strip_suffix(base).and_then(|rest| rest.strip_suffix('.')) {
                return Ok(VirtualHost::new(base).with_bucket(bucket));
            }
        }
        Ok(VirtualHost::new(host))
    }
}

/// Returns the bucket named by the host or else by the path, whether it exists or not.
pub(crate) fn bucket_of(headers: &HeaderMap, path: &str) -> Option<String> {
    if let Some(bucket) = in_host(headers) {
        return Some(bucket);
    }
    let path = percent_encoding::percent_decode_str(path).decode_utf8_lossy();
    let name = path.strip_prefix('/')?.split('/').next()?;
    (!name.is_empty()).then(|| name.to_owned())
}

/// Returns the bucket named by the host.
pub(crate) fn in_host(headers: &HeaderMap) -> Option<String> {
    let host = headers.get(HOST)?.to_str().ok()?;
    let is_address = host.parse::<SocketAddr>().is_ok() || host.parse::<IpAddr>().is_ok();
    let named = Hosts.parse_host_header(host).ok().filter(|_| !is_address)?;
    named.bucket().map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buckets_stand_before_localhost() {
        let bucket = |host| Hosts.parse_host_header(host).unwrap().bucket().map(str::to_owned);
        assert_eq!(bucket("films.localhost:9000").as_deref(), Some("films"));
        assert_eq!(bucket("films.s3.localhost").as_deref(), Some("films"));
        assert_eq!(bucket("my.films.s3.localhost:1").as_deref(), Some("my.films"));
        for none in ["localhost", "localhost:9000", "s3.localhost:9000", "store.example:80", "store"] {
            assert_eq!(bucket(none), None, "{none}");
        }
    }
}
