//! The requests that put, get and delete a bucket's CORS rules. `cors` interprets the rules.

use s3s::dto::{CORSRule, GetBucketCorsOutput};
use s3s::{S3Error, S3ErrorCode, s3_error};

use super::Service;
use super::objects::bucket;
use crate::answer::{Answer, invalid_request};
use crate::records::{CorsRule, set};
use crate::storage::{Kind, Table};

/// S3's limit on the rules of a bucket.
const MAX_RULES: usize = 100;

/// S3's limit on the length of a rule's id.
const LONGEST_ID: usize = 255;

const METHODS: [&str; 5] = ["GET", "PUT", "POST", "DELETE", "HEAD"];

impl Service {
    /// Returns the rules of a bucket. A bucket that is missing or unreadable has none.
    pub(crate) fn cors_rules(&self, name: &str) -> Vec<CorsRule> {
        let found = self.snapshot().and_then(|snapshot| self.bucket(&snapshot, name));
        found.map(|bucket| bucket.cors).unwrap_or_default()
    }

    pub(super) fn handle_get_bucket_cors(&self, name: &str) -> Answer<GetBucketCorsOutput> {
        let rules = self.bucket(&self.snapshot()?, name)?.cors;
        if rules.is_empty() {
            return Err(S3Error::with_message(
                S3ErrorCode::NoSuchCORSConfiguration,
                "The CORS configuration does not exist",
            ));
        }
        let some = |texts: Vec<String>| (!texts.is_empty()).then_some(texts);
        let output = rules.into_iter().map(|rule| CORSRule {
            allowed_headers: some(rule.headers),
            allowed_methods: rule.methods,
            allowed_origins: rule.origins,
            expose_headers: some(rule.exposed),
            id: rule.id,
            max_age_seconds: rule.max_age_seconds,
        });
        Ok(GetBucketCorsOutput { cors_rules: Some(output.collect()) })
    }

    pub(super) async fn handle_put_bucket_cors(&self, name: String, rules: Vec<CORSRule>) -> Answer<()> {
        if rules.is_empty() || rules.len() > MAX_RULES {
            return Err(s3_error!(MalformedXML, "A CORS configuration has between 1 and {MAX_RULES} rules"));
        }
        let rules = rules.into_iter().map(read).collect::<Answer<Vec<_>>>()?;
        self.cors_changed(name, Kind::Grows, rules).await
    }

    pub(super) async fn handle_delete_bucket_cors(&self, name: String) -> Answer<()> {
        self.cors_changed(name, Kind::Shrinks, Vec::new()).await
    }

    async fn cors_changed(&self, name: String, kind: Kind, rules: Vec<CorsRule>) -> Answer<()> {
        let change = self.change(kind, move |batch| {
            let mut record = bucket(batch, &name)?;
            record.cors = rules;
            Ok(set(batch, Table::Buckets, name.as_bytes(), &record)?)
        });
        change.await
    }
}

/// Converts a rule to the stored form.
fn read(rule: CORSRule) -> Answer<CorsRule> {
    let rule = CorsRule {
        id: rule.id,
        origins: rule.allowed_origins,
        methods: rule.allowed_methods,
        headers: rule.allowed_headers.unwrap_or_default(),
        exposed: rule.expose_headers.unwrap_or_default(),
        max_age_seconds: rule.max_age_seconds,
    };
    if rule.origins.is_empty() || rule.methods.is_empty() {
        return Err(s3_error!(MalformedXML, "A CORS rule has an AllowedOrigin and an AllowedMethod"));
    }
    if let Some(method) = rule.methods.iter().find(|method| !METHODS.contains(&method.as_str())) {
        return Err(invalid_request(format!(
            "Found unsupported HTTP method in CORS config. Unsupported method is {method}"
        )));
    }
    let many = |texts: &[String]| texts.iter().find(|text| text.matches('*').count() > 1).cloned();
    if let Some(origin) = many(&rule.origins) {
        return Err(invalid_request(format!(
            "AllowedOrigin \"{origin}\" can not have more than one wildcard."
        )));
    }
    if let Some(header) = many(&rule.headers) {
        return Err(invalid_request(format!(
            "AllowedHeader \"{header}\" can not have more than one wildcard."
        )));
    }
    if let Some(header) = rule.exposed.iter().find(|header| header.contains('*')) {
        return Err(invalid_request(format!(
            "ExposeHeader \"{header}\" contains wildcard. We currently do not support wildcard for ExposeHeader."
        )));
    }
    if rule.id.as_ref().is_some_and(|id| id.len() > LONGEST_ID) {
        return Err(invalid_request(format!("The id of a CORS rule has at most {LONGEST_ID} bytes")));
    }
    if rule.max_age_seconds.is_some_and(|age| age < 0) {
        return Err(invalid_request("MaxAgeSeconds is negative"));
    }
    Ok(rule)
}
