//! Sets up a bucket where no other program does. On AWS Terraform sets it up; on a laptop this module does.

use aws_sdk_s3::types::{
    CorsConfiguration, CorsRule, Event, FilterRule, FilterRuleName, NotificationConfiguration,
    NotificationConfigurationFilter, QueueConfiguration, S3KeyFilter,
};

use super::S3Store;
use super::answers::error_of;
use crate::store::{ListRequest, Store};
use crate::{Error, Result};

/// A rule that sends events of keys below a prefix to a queue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notification {
    /// The prefix of the keys whose events are sent.
    pub prefix: String,
    /// S3's names of the events.
    pub events: Vec<String>,
    /// The ARN of the queue.
    pub queue_arn: String,
}

impl S3Store {
    /// Creates the bucket. It is no error if it exists and is ours.
    ///
    /// # Errors
    /// [`Error::Refused`] if the name is not allowed, or another account has it.
    pub async fn create_bucket(&self) -> Result<()> {
        match self.client.create_bucket().bucket(&self.bucket).send().await {
            Ok(_) => Ok(()),
            Err(error) if error.as_service_error().is_some_and(|e| e.is_bucket_already_owned_by_you()) => {
                Ok(())
            }
            Err(error) => match error_of(&self.bucket, error) {
                Error::Conflict { key } => {
                    let source = "the name is taken".into();
                    Err(Error::Refused { key, source })
                }
                error => Err(error),
            },
        }
    }

    /// Sets the bucket's notifications in place of the former ones.
    ///
    /// # Errors
    /// [`Error::Refused`] if a queue is unknown or two prefixes overlap.
    pub async fn notify(&self, notifications: &[Notification]) -> Result<()> {
        let mut queues = Vec::new();
        for (number, notification) in notifications.iter().enumerate() {
            let rule = FilterRule::builder().name(FilterRuleName::Prefix).value(&notification.prefix).build();
            let keys = S3KeyFilter::builder().filter_rules(rule).build();
            let events = notification.events.iter().map(|event| Event::from(event.as_str())).collect();
            let queue = QueueConfiguration::builder()
                .id(format!("rayfold-{number}"))
                .queue_arn(&notification.queue_arn)
                .set_events(Some(events))
                .filter(NotificationConfigurationFilter::builder().key(keys).build())
                .build()
                .map_err(|error| Error::Refused { key: notification.prefix.clone(), source: error.into() })?;
            queues.push(queue);
        }
        let configuration =
            NotificationConfiguration::builder().set_queue_configurations(Some(queues)).build();
        let request = self.client.put_bucket_notification_configuration().bucket(&self.bucket);
        let answer = request.notification_configuration(configuration).send().await;
        answer.map(drop).map_err(|error| error_of(&self.bucket, error))
    }

    /// Lets the pages of an origin, such as `http://127.0.0.1:8000`, use the bucket from a browser. Their requests are signed as
    /// all others are.
    ///
    /// # Errors
    /// Fails if the store does.
    pub async fn allow_page(&self, origin: &str) -> Result<()> {
        let refused = |source: aws_sdk_s3::error::BuildError| Error::Refused {
            key: self.bucket.clone(),
            source: source.into(),
        };
        let all = |names: &[&str]| Some(names.iter().map(|&name| name.to_owned()).collect());
        let rule = CorsRule::builder()
            .allowed_origins(origin)
            .set_allowed_methods(all(&["DELETE", "GET", "HEAD", "PUT"]))
            .set_allowed_headers(all(&["authorization", "content-type", "x-amz-*"]))
            .set_expose_headers(all(&["ETag", "x-amz-meta-generation"]))
            .max_age_seconds(3600)
            .build()
            .map_err(refused)?;
        let rules = CorsConfiguration::builder().cors_rules(rule).build().map_err(refused)?;
        let request = self.client.put_bucket_cors().bucket(&self.bucket).cors_configuration(rules);
        request.send().await.map(drop).map_err(|error| error_of(&self.bucket, error))
    }

    /// Checks that the bucket can be listed: the cheapest request that fails if the others would.
    ///
    /// # Errors
    /// [`Error::Refused`] if there is no such bucket, or it is not ours.
    pub async fn check(&self) -> Result<()> {
        let nothing = ListRequest { start_after: Some("~".into()), ..ListRequest::all("~") };
        self.list(nothing).await.map(drop)
    }
}
