//! Which bucket a host name says: `bucket.localhost:9000` and `bucket.s3.localhost:9000` are buckets, any other host is
//! the store itself, and the bucket is the first part of the path.

use s3s::S3Result;
use s3s::host::{S3Host, VirtualHost};

/// What comes after the bucket in a host name, the longer one first.
const BASES: [&str; 2] = ["s3.localhost", "localhost"];

/// See the module.
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
