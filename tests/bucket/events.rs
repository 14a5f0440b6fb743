//! Events: every change is delivered at least once, in the order of an object's changes, also across restarts.

use std::time::{Duration, Instant};

use rayfold_bucket::Server;

use crate::stage::{BUCKET, client, listener, notify, options, stage, stage_with};

fn event(name: &str, key: &str) -> (String, String) {
    (name.into(), key.into())
}

#[tokio::test]
async fn every_kind_of_change_sends_an_event() {
    let (webhook, heard) = listener(0).await;
    let stage = stage_with(Some(webhook)).await;
    stage.put("before", "nobody asked yet").await;
    stage.notify().await;
    stage.put("a b/ü+1", "1").await;
    heard.wait(1).await;
    let copy = stage.client.copy_object().bucket(BUCKET).key("copy").copy_source(format!("{BUCKET}/before"));
    copy.send().await.unwrap();
    heard.wait(2).await;
    stage.client.delete_object().bucket(BUCKET).key("copy").send().await.unwrap();
    stage.client.delete_object().bucket(BUCKET).key("never there").send().await.unwrap();
    let all = heard.wait(3).await;
    let expected = [
        event("ObjectCreated:Put", "a+b/%C3%BC%2B1"),
        event("ObjectCreated:Copy", "copy"),
        event("ObjectRemoved:Delete", "copy"),
    ];
    assert_eq!(all, expected);
    tokio::time::sleep(Duration::from_millis(50)).await;
    assert_eq!(heard.all().len(), 3, "an event was sent for an absent object");
}

#[tokio::test]
async fn each_object_of_a_delete_of_many_sends_an_event() {
    use aws_sdk_s3::types::{Delete, ObjectIdentifier};
    let (webhook, heard) = listener(0).await;
    let stage = stage_with(Some(webhook)).await;
    for key in ["a", "b", "c"] {
        stage.put(key, "1").await;
    }
    stage.notify().await;
    let object = |key: &str| ObjectIdentifier::builder().key(key).build().unwrap();
    let many = Delete::builder().objects(object("a")).objects(object("never there")).objects(object("c"));
    let delete = stage.client.delete_objects().bucket(BUCKET).delete(many.build().unwrap());
    delete.send().await.unwrap();
    let mut events = heard.wait(2).await;
    events.sort();
    assert_eq!(events, [event("ObjectRemoved:Delete", "a"), event("ObjectRemoved:Delete", "c")]);
    tokio::time::sleep(Duration::from_millis(50)).await;
    assert_eq!(heard.all().len(), 2, "an event was sent for an absent object");
}

#[tokio::test]
async fn an_objects_events_stay_in_order_while_the_listener_refuses() {
    let (webhook, heard) = listener(30).await;
    let stage = stage_with(Some(webhook)).await;
    stage.notify().await;
    for round in 0..10 {
        for key in ["x", "y", "z"] {
            if round % 2 == 0 {
                stage.put(key, round.to_string()).await;
            } else {
                stage.client.delete_object().bucket(BUCKET).key(key).send().await.unwrap();
            }
        }
    }
    let all = heard.wait(30).await;
    for key in ["x", "y", "z"] {
        let names: Vec<_> = all.iter().filter(|(_, of)| of == key).map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["ObjectCreated:Put", "ObjectRemoved:Delete"].repeat(5), "{key}");
    }
}

/// The pauses double, from 20 ms on. Within half a second there are five attempts, not thousands.
#[tokio::test]
async fn a_listener_that_refuses_is_not_pressed() {
    let (webhook, heard) = listener(usize::MAX).await;
    let stage = stage_with(Some(webhook)).await;
    stage.notify().await;
    stage.put("a", "1").await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    assert!((1..=6).contains(&heard.refused()), "asked {} times", heard.refused());
}

#[tokio::test]
async fn a_server_that_is_dropped_tells_nothing_more() {
    let (webhook, heard) = listener(usize::MAX).await;
    let stage = stage_with(Some(webhook)).await;
    stage.notify().await;
    stage.put("a", "1").await;
    while heard.refused() == 0 {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    drop(stage.server);
    tokio::time::sleep(Duration::from_millis(50)).await;
    let asked = heard.refused();
    // The next pauses would take 40 to 320 ms.
    tokio::time::sleep(Duration::from_millis(700)).await;
    assert_eq!(heard.refused(), asked);
}

#[tokio::test]
async fn events_wait_for_a_listener_across_restarts() {
    let stage = stage().await;
    stage.notify().await;
    for number in 0..50 {
        stage.put(&format!("{number:02}"), "1").await;
    }
    stage.server.stop().await;
    let (webhook, heard) = listener(3).await;
    let server = Server::start(options(stage.folder.path(), Some(webhook.clone()))).await.unwrap();
    let mut keys: Vec<_> = heard.wait(50).await.into_iter().map(|(_, key)| key).collect();
    keys.sort();
    assert_eq!(keys, (0..50).map(|number| format!("{number:02}")).collect::<Vec<_>>());
    // Delivered events are deleted after a while.
    tokio::time::sleep(Duration::from_millis(100)).await;
    server.stop().await;
    let server = Server::start(options(stage.folder.path(), Some(webhook))).await.unwrap();
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert_eq!(heard.all().len(), 50, "events were sent again after a stop in order");
    server.stop().await;
}

#[tokio::test]
async fn notifications_are_read_back_and_filter_by_prefix_and_suffix() {
    use aws_sdk_s3::types::{
        Event, FilterRule, FilterRuleName, NotificationConfiguration, NotificationConfigurationFilter,
        QueueConfiguration, S3KeyFilter,
    };
    let (webhook, heard) = listener(0).await;
    let stage = stage_with(Some(webhook)).await;
    let filter = |name, value: &str| FilterRule::builder().name(name).value(value).build();
    let key = S3KeyFilter::builder()
        .filter_rules(filter(FilterRuleName::Prefix, "scripts/"))
        .filter_rules(filter(FilterRuleName::Suffix, ".txt"))
        .build();
    let queue = QueueConfiguration::builder()
        .id("scripts")
        .queue_arn(rayfold_bucket::QUEUE_ARN)
        .events(Event::from("s3:ObjectCreated:Put"))
        .filter(NotificationConfigurationFilter::builder().key(key).build())
        .build()
        .unwrap();
    let configuration = NotificationConfiguration::builder().queue_configurations(queue.clone()).build();
    let set = stage.client.put_bucket_notification_configuration().bucket(BUCKET);
    set.notification_configuration(configuration).send().await.unwrap();
    let configuration =
        stage.client.get_bucket_notification_configuration().bucket(BUCKET).send().await.unwrap();
    assert_eq!(configuration.queue_configurations(), [queue]);
    for key in ["scripts/a.json", "frames/a.txt", "scripts/a.txt"] {
        stage.put(key, "1").await;
    }
    assert_eq!(heard.wait(1).await, [event("ObjectCreated:Put", "scripts/a.txt")]);
}

#[tokio::test]
async fn an_event_is_sent_within_moments() {
    let (webhook, heard) = listener(0).await;
    let stage = stage_with(Some(webhook)).await;
    notify(&client(stage.server.address())).await;
    let mut slowest = Duration::ZERO;
    for number in 1..=20 {
        stage.put(&number.to_string(), "1").await;
        let put = Instant::now();
        while heard.all().len() < number {
            tokio::time::sleep(Duration::from_micros(200)).await;
        }
        slowest = slowest.max(put.elapsed());
    }
    // Far above the usual time, far below a polling interval.
    assert!(slowest < Duration::from_secs(1), "{slowest:?}");
    println!("slowest of 20 events: {slowest:?}");
}
