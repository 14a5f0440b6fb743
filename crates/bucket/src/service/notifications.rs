//! PutBucketNotificationConfiguration and GetBucketNotificationConfiguration: the rules that select changes with
//! events. There is a single queue.

use s3s::dto::*;

use super::Service;
use super::objects::bucket;
use crate::QUEUE_ARN;
use crate::answer::{Answer, invalid_argument, not_implemented};
use crate::records::{self, set};
use crate::storage::{Kind, Table};

/// S3's limit on the rules of a bucket.
const MAX_RULES: usize = 100;

/// The events that the store sends. S3's other events are accepted in a pattern only.
const EVENTS: [&str; 5] = [
    "s3:ObjectCreated:Put",
    "s3:ObjectCreated:Copy",
    "s3:ObjectCreated:CompleteMultipartUpload",
    "s3:ObjectCreated:Post",
    "s3:ObjectRemoved:Delete",
];

impl Service {
    pub(super) async fn handle_put_bucket_notification(
        &self,
        input: PutBucketNotificationConfigurationInput,
    ) -> Answer<PutBucketNotificationConfigurationOutput> {
        let configuration = input.notification_configuration;
        if configuration.event_bridge_configuration.is_some() {
            return Err(not_implemented("EventBridge"));
        }
        let elsewhere = configuration.lambda_function_configurations.is_some_and(|all| !all.is_empty())
            || configuration.topic_configurations.is_some_and(|all| !all.is_empty());
        if elsewhere {
            return Err(not_implemented("a notification of a function or a topic"));
        }
        let queues = configuration.queue_configurations.unwrap_or_default();
        if queues.len() > MAX_RULES {
            return Err(invalid_argument(format!("at most {MAX_RULES} notifications")));
        }
        let rules = queues.into_iter().enumerate().map(|(number, queue)| rule(number, queue));
        let rules = rules.collect::<Answer<Vec<_>>>()?;
        let name = input.bucket;
        let set = self.change(Kind::Grows, move |batch| {
            let record = records::Bucket { notifications: rules, ..bucket(batch, &name)? };
            Ok(set(batch, Table::Buckets, name.as_bytes(), &record)?)
        });
        set.await?;
        Ok(PutBucketNotificationConfigurationOutput {})
    }

    pub(super) fn handle_get_bucket_notification(
        &self,
        input: &GetBucketNotificationConfigurationInput,
    ) -> Answer<GetBucketNotificationConfigurationOutput> {
        let rules = self.bucket(&self.snapshot()?, &input.bucket)?.notifications;
        let to_output = |rule: records::Notification| {
            let filters = [(FilterRuleName::PREFIX, rule.prefix), (FilterRuleName::SUFFIX, rule.suffix)];
            let filters: Vec<_> = filters
                .into_iter()
                .filter(|(_, value)| !value.is_empty())
                .map(|(name, value)| FilterRule {
                    name: Some(FilterRuleName::from_static(name)),
                    value: Some(value),
                })
                .collect();
            let filter = (!filters.is_empty()).then_some(NotificationConfigurationFilter {
                key: Some(S3KeyFilter { filter_rules: Some(filters) }),
            });
            QueueConfiguration {
                events: rule.events.into_iter().map(Event::from).collect(),
                filter,
                id: Some(rule.id),
                queue_arn: rule.queue,
            }
        };
        let queues: Vec<_> = rules.into_iter().map(to_output).collect();
        Ok(GetBucketNotificationConfigurationOutput {
            queue_configurations: (!queues.is_empty()).then_some(queues),
            ..GetBucketNotificationConfigurationOutput::default()
        })
    }
}

fn rule(number: usize, queue: QueueConfiguration) -> Answer<records::Notification> {
    if queue.queue_arn != QUEUE_ARN {
        let message = "Unable to validate the following destination configurations";
        return Err(invalid_argument(format!("{message}: the only queue here is {QUEUE_ARN}")));
    }
    let events: Vec<String> = queue.events.iter().map(|event| event.as_ref().to_owned()).collect();
    if events.is_empty() {
        return Err(invalid_argument("a notification names at least one event"));
    }
    for event in &events {
        let known = match event.strip_suffix('*') {
            Some(start) => EVENTS.iter().any(|known| known.starts_with(start)),
            None => EVENTS.contains(&event.as_str()),
        };
        if !known {
            return Err(not_implemented(&format!("the event {event}")));
        }
    }
    let mut rule = records::Notification {
        id: queue.id.unwrap_or_else(|| format!("notification-{number}")),
        queue: queue.queue_arn,
        events,
        prefix: String::new(),
        suffix: String::new(),
    };
    let filters = queue.filter.and_then(|filter| filter.key).and_then(|key| key.filter_rules);
    for filter in filters.unwrap_or_default() {
        let name = filter.name.map(|name| name.as_str().to_ascii_lowercase());
        let place = match name.as_deref() {
            Some(FilterRuleName::PREFIX) => &mut rule.prefix,
            Some(FilterRuleName::SUFFIX) => &mut rule.suffix,
            _ => return Err(invalid_argument("filter rule name must be either prefix or suffix")),
        };
        if !place.is_empty() {
            return Err(invalid_argument(
                "Cannot specify more than one rule with the same name in a filter.",
            ));
        }
        *place = filter.value.unwrap_or_default();
    }
    Ok(rule)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_read_and_what_is_not_there_is_refused() {
        let queue = |arn: &str, events: &[&str]| QueueConfiguration {
            events: events.iter().map(|event| Event::from((*event).to_owned())).collect(),
            filter: None,
            id: None,
            queue_arn: arn.to_owned(),
        };
        assert!(rule(0, queue(QUEUE_ARN, &["s3:ObjectCreated:*", "s3:ObjectRemoved:*"])).is_ok());
        assert!(rule(0, queue("arn:aws:sqs:us-east-1:1:other", &["s3:ObjectCreated:*"])).is_err());
        assert!(rule(0, queue(QUEUE_ARN, &["s3:ObjectRestore:Completed"])).is_err());
        assert!(rule(0, queue(QUEUE_ARN, &[])).is_err());
    }
}
