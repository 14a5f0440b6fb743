//! What AWS asks, from one data file with its date.

use serde::Deserialize;

/// The prices that come with the program: those of `infra/prices.json`.
pub(super) const BUILT_IN: &str = include_str!("../../../../infra/prices.json");

/// US dollars, each for one of what its name says.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Prices {
    /// The day on which they were so, as `2026-03-14`.
    pub(super) as_of: String,
    pub(super) region: String,
    pub(super) currency: String,
    /// The pages that say so.
    pub(super) sources: Vec<String>,
    pub(super) lambda: Lambda,
    pub(super) s3: S3,
    pub(super) transfer_out_gb: f64,
    pub(super) cloudwatch: CloudWatch,
    pub(super) xray_trace: f64,
    pub(super) sqs_request: f64,
    pub(super) scheduler_invocation: f64,
    pub(super) kms_key_month: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lambda {
    pub(super) request: f64,
    pub(super) gb_second_x86_64: f64,
    pub(super) gb_second_arm64: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct S3 {
    pub(super) put_copy_post_list: f64,
    pub(super) get_and_other: f64,
    pub(super) standard_gb_month: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CloudWatch {
    pub(super) log_gb: f64,
    pub(super) alarm_month: f64,
    pub(super) dashboard_month: f64,
}
