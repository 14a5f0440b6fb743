//! What AWS asks, from one data file with its date.

use serde::Deserialize;

/// The prices that come with the program: those of `infra/prices.json`.
const BUILT_IN: &str = include_str!("../../../../infra/prices.json");

/// US dollars, each for one of what its name says.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prices {
    /// The day on which they were so, as `2026-03-14`.
    pub as_of: String,
    /// The region.
    pub region: String,
    /// Always `USD`.
    pub currency: String,
    /// The pages that say so.
    pub sources: Vec<String>,
    /// Functions.
    pub lambda: Lambda,
    /// Objects.
    pub s3: S3,
    /// Downloads.
    pub transfer_out_gb: f64,
    /// Logs, alarms, dashboards.
    pub cloudwatch: CloudWatch,
    /// Traces.
    pub xray_trace: f64,
    /// Queues.
    pub sqs_request: f64,
    /// Schedules.
    pub scheduler_invocation: f64,
    /// Keys.
    pub kms_key_month: f64,
}

impl Prices {
    /// Those that come with the program.
    ///
    /// # Errors
    /// When the program was built with a file that holds no prices.
    pub fn built_in() -> Result<Self, serde_json::Error> {
        serde_json::from_str(BUILT_IN)
    }
}

/// What Lambda asks.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lambda {
    /// An invocation.
    pub request: f64,
    /// Memory times time.
    pub gb_second_x86_64: f64,
    /// The same, on arm64.
    pub gb_second_arm64: f64,
}

/// What S3 asks.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct S3 {
    /// A request of these.
    pub put_copy_post_list: f64,
    /// Any other request.
    pub get_and_other: f64,
    /// Storage.
    pub standard_gb_month: f64,
}

/// What CloudWatch asks.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CloudWatch {
    /// Logs that come in.
    pub log_gb: f64,
    /// An alarm's metric.
    pub alarm_month: f64,
    /// A dashboard.
    pub dashboard_month: f64,
}
