//! The prices of AWS, from one data file with its date.

use serde::Deserialize;

/// The built-in prices: those of `infra/prices.json`.
const BUILT_IN: &str = include_str!("../../../../infra/prices.json");

/// The prices in US dollars, each for one unit of the thing that the field's name says.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prices {
    /// The date of the prices, as `2026-03-14`.
    pub as_of: String,
    /// The region of the prices.
    pub region: String,
    /// The currency, which is always `USD`.
    pub currency: String,
    /// The pages from which the prices were taken.
    pub sources: Vec<String>,
    /// The prices of Lambda functions.
    pub lambda: Lambda,
    /// The prices of S3 objects.
    pub s3: S3,
    /// A GB transferred out to the internet.
    pub transfer_out_gb: f64,
    /// The prices of logs, alarms and dashboards.
    pub cloudwatch: CloudWatch,
    /// A trace recorded by X-Ray.
    pub xray_trace: f64,
    /// A request to an SQS queue.
    pub sqs_request: f64,
    /// An invocation by the scheduler.
    pub scheduler_invocation: f64,
    /// A KMS key for a month.
    pub kms_key_month: f64,
}

impl Prices {
    /// Returns the prices that are built into the program.
    ///
    /// # Errors
    /// An error if the program was built with a file that holds no prices.
    pub fn built_in() -> Result<Self, serde_json::Error> {
        serde_json::from_str(BUILT_IN)
    }
}

/// The prices of Lambda.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lambda {
    /// An invocation of a function.
    pub request: f64,
    /// A GB-second of memory on x86_64.
    pub gb_second_x86_64: f64,
    /// A GB-second of memory on arm64.
    pub gb_second_arm64: f64,
}

/// The prices of S3.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct S3 {
    /// A PUT, COPY, POST or LIST request.
    pub put_copy_post_list: f64,
    /// A request of any other kind.
    pub get_and_other: f64,
    /// A GB of standard storage for a month.
    pub standard_gb_month: f64,
}

/// The prices of CloudWatch.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CloudWatch {
    /// A GB of logs ingested.
    pub log_gb: f64,
    /// A metric of an alarm for a month.
    pub alarm_month: f64,
    /// A dashboard for a month.
    pub dashboard_month: f64,
}
