# What a stack is that was given nothing but a name.

mock_provider "aws" {
  source = "./tests/mocks"
}

variables {
  name = "demo"
  packages = {
    render   = "tests/packages/rayfold-render.zip"
    assemble = "tests/packages/rayfold-assemble.zip"
  }
}

run "bucket" {
  assert {
    condition     = aws_s3_bucket.this[0].bucket == "demo-123456789012-eu-central-1"
    error_message = "the bucket's name must hold account and region, which makes it unique"
  }
  assert {
    condition     = aws_s3_bucket.this[0].force_destroy == false
    error_message = "destroying the stack must not take the objects with it"
  }
  assert {
    condition = alltrue([
      aws_s3_bucket_public_access_block.this[0].block_public_acls,
      aws_s3_bucket_public_access_block.this[0].block_public_policy,
      aws_s3_bucket_public_access_block.this[0].ignore_public_acls,
      aws_s3_bucket_public_access_block.this[0].restrict_public_buckets,
    ])
    error_message = "nothing may be public"
  }
  assert {
    condition     = aws_s3_bucket_ownership_controls.this[0].rule[0].object_ownership == "BucketOwnerEnforced"
    error_message = "the account must own every object, and access lists must be off"
  }
  assert {
    condition     = aws_s3_bucket_versioning.this[0].versioning_configuration[0].status == "Enabled"
    error_message = "an overwritten script must be recoverable"
  }
  assert {
    condition     = one(one(aws_s3_bucket_server_side_encryption_configuration.this[0].rule).apply_server_side_encryption_by_default).sse_algorithm == "AES256"
    error_message = "without a key of its own the bucket uses S3's, which keeps ETags a hash of the content"
  }
  assert {
    condition = jsondecode(aws_s3_bucket_policy.this[0].policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [
        {
          Sid       = "TlsOnly"
          Effect    = "Deny"
          Principal = "*"
          Action    = "s3:*"
          Resource  = ["arn:aws:s3:::demo-123456789012-eu-central-1", "arn:aws:s3:::demo-123456789012-eu-central-1/*"]
          Condition = { Bool = { "aws:SecureTransport" = "false" } }
        },
        {
          Sid       = "Tls12OrNewer"
          Effect    = "Deny"
          Principal = "*"
          Action    = "s3:*"
          Resource  = ["arn:aws:s3:::demo-123456789012-eu-central-1", "arn:aws:s3:::demo-123456789012-eu-central-1/*"]
          Condition = { NumericLessThan = { "s3:TlsVersion" = "1.2" } }
        },
      ]
    }))
    error_message = "the bucket's policy must deny what does not come by TLS, and allow nobody anything"
  }
  assert {
    condition     = length(aws_s3_bucket_logging.this) == 0 && length(aws_budgets_budget.this) == 0 && !aws_s3_bucket_notification.this.eventbridge && length(aws_s3_bucket_notification.this.topic) == 0
    error_message = "what costs or needs something from outside is off until it is asked for"
  }
}

run "lifecycle" {
  assert {
    condition = sort([for rule in aws_s3_bucket_lifecycle_configuration.this[0].rule : rule.id]) == tolist([
      "noncurrent-animations", "noncurrent-assemblies", "noncurrent-checkpoints", "noncurrent-frames", "noncurrent-manifests", "noncurrent-parts",
      "noncurrent-retries", "noncurrent-scripts", "spent-assemblies", "spent-checkpoints", "spent-retries",
      "unfinished-uploads-and-lone-delete-markers",
    ])
    error_message = "there must be these rules and no other"
  }
  assert {
    condition = alltrue([
      for rule in aws_s3_bucket_lifecycle_configuration.this[0].rule :
      rule.status == "Enabled" && length(rule.transition) == 0 && length(rule.noncurrent_version_transition) == 0
    ])
    error_message = "every rule must be on, and none may move objects to where reading them costs more"
  }
  assert {
    condition = {
      for rule in aws_s3_bucket_lifecycle_configuration.this[0].rule : one(rule.filter).prefix => one(rule.expiration).days
      if length(rule.expiration) > 0 ? one(rule.expiration).days != null && one(rule.expiration).days != 0 : false
    } == { "assemblies/" = 7, "retries/" = 7, "checkpoints/" = 1 }
    error_message = "only claims, retry orders and checkpoints may expire by age: every other current object is a receipt"
  }
  assert {
    condition = {
      for rule in aws_s3_bucket_lifecycle_configuration.this[0].rule : one(rule.filter).prefix => one(rule.noncurrent_version_expiration).noncurrent_days
      if length(rule.noncurrent_version_expiration) > 0
      } == {
      "scripts/" = 30, "animations/" = 30, "parts/" = 1, "frames/" = 1, "manifests/" = 1, "assemblies/" = 1, "retries/" = 1, "checkpoints/" = 1
    }
    error_message = "old versions must go, below every prefix"
  }
  assert {
    condition = [
      for rule in aws_s3_bucket_lifecycle_configuration.this[0].rule : one(rule.abort_incomplete_multipart_upload).days_after_initiation
      if length(rule.abort_incomplete_multipart_upload) > 0
    ] == [1]
    error_message = "the parts of a GIF that was given up must not be billed for longer than a day"
  }
}

run "functions" {
  assert {
    condition     = { for key, function in aws_lambda_function.this : key => function.function_name } == { render = "demo-render", assemble = "demo-assemble", record = "demo-record" }
    error_message = "there must be these functions"
  }
  assert {
    condition = alltrue([
      for function in aws_lambda_function.this : alltrue([
        function.runtime == "provided.al2023",
        function.architectures == tolist(["x86_64"]),
        function.handler == "bootstrap",
        one(function.tracing_config).mode == "Active",
        one(function.logging_config).log_format == "JSON",
        one(function.logging_config).application_log_level == "INFO",
        one(function.ephemeral_storage).size == 512,
        function.reserved_concurrent_executions == null,
        function.code_signing_config_arn == null,
        length(function.vpc_config) == 0,
        one(function.environment).variables["RAYFOLD_BUCKET"] == "demo-123456789012-eu-central-1",
      ])
    ])
    error_message = "runtime, architecture, tracing, logs and settings of the functions"
  }
  assert {
    condition = {
      for key, function in aws_lambda_function.this : key => [function.memory_size, function.timeout]
    } == { render = [1769, 300], assemble = [3008, 900], record = [512, 60] }
    error_message = "memory (MB) and timeout (s)"
  }
  assert {
    condition = {
      for key, function in aws_lambda_function.this : key => function.source_code_hash
      } == {
      render   = filebase64sha256("tests/packages/rayfold-render.zip")
      assemble = filebase64sha256("tests/packages/rayfold-assemble.zip")
      record   = filebase64sha256("tests/packages/rayfold-assemble.zip")
    }
    error_message = "a changed package must change the function"
  }
  assert {
    condition     = { for key, function in aws_lambda_function.this : key => function.role } == { for key, role in aws_iam_role.function : key => role.arn }
    error_message = "each function must have the role of its own"
  }
  assert {
    condition = alltrue([for key, group in aws_cloudwatch_log_group.this : alltrue([
      group.name == "/aws/lambda/demo-${key}",
      one(aws_lambda_function.this[key].logging_config).log_group == group.name,
      group.retention_in_days == 30,
    ])])
    error_message = "each function must write into its own log group, which forgets"
  }
  assert {
    condition     = { for key, config in aws_lambda_function_recursion_config.this : config.function_name => config.recursive_loop } == { demo-render = "Terminate", demo-assemble = "Terminate", demo-record = "Terminate" }
    error_message = "Lambda's recursion detection must stay on"
  }
}

run "limits_fit_the_memory" {
  assert {
    condition = aws_lambda_function.this["render"].environment[0].variables == tomap({
      RAYFOLD_BUCKET               = "demo-123456789012-eu-central-1"
      RAYFOLD_MAX_ANIMATION_FRAMES = "100000"
      RAYFOLD_MAX_BANDS            = "64"
      RAYFOLD_MAX_FRAMES           = "10000"
      RAYFOLD_MAX_LIGHTS           = "1024"
      RAYFOLD_MAX_OBJECTS          = "1817300"
      RAYFOLD_MAX_PIXELS           = "64000000"
      RAYFOLD_MAX_SCRIPT_BYTES     = "268435456"
    })
    error_message = "4 million spheres take 1,971 MiB, and the function has 1,769 MB"
  }
  assert {
    condition = alltrue([
      for function in ["assemble", "record"] :
      aws_lambda_function.this[function].environment[0].variables == tomap({
        RAYFOLD_BUCKET               = "demo-123456789012-eu-central-1"
        RAYFOLD_MAX_ANIMATION_FRAMES = "100000"
        RAYFOLD_MAX_PIXELS           = "64000000"
      })
    ])
    error_message = "only the render function reads scripts"
  }
}

run "routes" {
  assert {
    condition = {
      for route in aws_s3_bucket_notification.this.lambda_function : route.filter_prefix => [route.lambda_function_arn, join(" ", sort(route.events))]
      } == {
      "scripts/"    = ["arn:aws:lambda:eu-central-1:123456789012:function:demo-render", "s3:ObjectCreated:* s3:ObjectRemoved:*"]
      "parts/"      = ["arn:aws:lambda:eu-central-1:123456789012:function:demo-render", "s3:ObjectCreated:*"]
      "retries/"    = ["arn:aws:lambda:eu-central-1:123456789012:function:demo-render", "s3:ObjectCreated:*"]
      "assemblies/" = ["arn:aws:lambda:eu-central-1:123456789012:function:demo-assemble", "s3:ObjectCreated:*"]
    }
    error_message = "these prefixes must wake these functions"
  }
  assert {
    condition = (
      [for route in aws_s3_bucket_notification.this.lambda_function : [route.filter_prefix, sort(route.events)]] ==
      [for route in jsondecode(file("routes.json")).routes : [route.prefix, sort(route.events)]]
    )
    error_message = "the routes must be those of routes.json, which the local invoker reads"
  }
  assert {
    condition = alltrue([for key, permission in aws_lambda_permission.bucket : alltrue([
      permission.function_name == "demo-${key}",
      permission.principal == "s3.amazonaws.com",
      permission.action == "lambda:InvokeFunction",
      permission.source_arn == aws_s3_bucket.this[0].arn,
      permission.source_account == "123456789012",
    ])]) && toset(keys(aws_lambda_permission.bucket)) == toset([for route in jsondecode(file("routes.json")).routes : route.function])
    error_message = "only this bucket of this account may wake the functions"
  }
}

run "failures" {
  assert {
    condition = alltrue([for key, config in aws_lambda_function_event_invoke_config.this : alltrue([
      config.function_name == "demo-${key}",
      config.maximum_retry_attempts == 2,
      config.maximum_event_age_in_seconds == 21600,
      one(one(config.destination_config).on_failure).destination == aws_sqs_queue.failures.arn,
    ])]) && length(aws_lambda_function_event_invoke_config.this) == 2
    error_message = "an event that failed must end in the failure queue, whichever function it was for"
  }
  assert {
    condition = alltrue([
      aws_lambda_event_source_mapping.failures.event_source_arn == aws_sqs_queue.failures.arn,
      aws_lambda_event_source_mapping.failures.function_name == "arn:aws:lambda:eu-central-1:123456789012:function:demo-record",
      aws_lambda_event_source_mapping.failures.function_response_types == toset(["ReportBatchItemFailures"]),
      aws_lambda_event_source_mapping.failures.batch_size == 10,
      one(aws_lambda_event_source_mapping.failures.scaling_config).maximum_concurrency == 2,
    ])
    error_message = "the record function must read the failure queue, and answer for each record"
  }
  assert {
    condition     = aws_sqs_queue.failures.visibility_timeout_seconds == 6 * aws_lambda_function.this["record"].timeout && aws_sqs_queue.failures.visibility_timeout_seconds == 360
    error_message = "a batch that is being worked on must not be handed out again, and a record that fails once must not wait for 90 minutes"
  }
  assert {
    condition = jsondecode(aws_sqs_queue.failures.redrive_policy) == {
      deadLetterTargetArn = aws_sqs_queue.dead_letters.arn
      maxReceiveCount     = 5
    }
    error_message = "what cannot be recorded must be kept for people"
  }
  assert {
    condition = jsondecode(aws_sqs_queue_redrive_allow_policy.dead_letters.redrive_allow_policy) == {
      redrivePermission = "byQueue"
      sourceQueueArns   = [aws_sqs_queue.failures.arn]
    }
    error_message = "no other queue may use the dead-letter queue"
  }
  assert {
    condition = alltrue([for queue in [aws_sqs_queue.failures, aws_sqs_queue.dead_letters] : alltrue([
      queue.message_retention_seconds == 1209600,
      queue.sqs_managed_sse_enabled == true,
      queue.kms_master_key_id == null,
    ])])
    error_message = "both queues must keep messages as long as SQS can, encrypted"
  }
  assert {
    condition = alltrue([for key, policy in aws_sqs_queue_policy.tls_only : jsondecode(policy.policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [{
        Sid       = "TlsOnly"
        Effect    = "Deny"
        Principal = "*"
        Action    = "sqs:*"
        Resource  = { failures = aws_sqs_queue.failures.arn, dead_letters = aws_sqs_queue.dead_letters.arn }[key]
        Condition = { Bool = { "aws:SecureTransport" = "false" } }
      }]
    }))]) && length(aws_sqs_queue_policy.tls_only) == 2
    error_message = "both queues must deny what does not come by TLS, and allow nobody anything"
  }
}

run "sweep" {
  assert {
    condition = alltrue([
      aws_scheduler_schedule.sweep.name == "demo-sweep",
      aws_scheduler_schedule.sweep.group_name == "demo",
      aws_scheduler_schedule.sweep.schedule_expression == "rate(15 minutes)",
      one(aws_scheduler_schedule.sweep.flexible_time_window).mode == "OFF",
      one(aws_scheduler_schedule.sweep.target).arn == "arn:aws:lambda:eu-central-1:123456789012:function:demo-assemble",
      one(aws_scheduler_schedule.sweep.target).role_arn == "arn:aws:iam::123456789012:role/demo-eu-central-1-sweep-schedule",
      jsondecode(one(aws_scheduler_schedule.sweep.target).input) == { sweep = true },
      one(one(aws_scheduler_schedule.sweep.target).dead_letter_config).arn == aws_sqs_queue.dead_letters.arn,
      one(one(aws_scheduler_schedule.sweep.target).retry_policy).maximum_event_age_in_seconds == 840,
      one(one(aws_scheduler_schedule.sweep.target).retry_policy).maximum_retry_attempts == 2,
    ])
    error_message = "the assemble function must sweep every quarter of an hour"
  }
}

run "alarms" {
  assert {
    condition = toset(concat(
      [for alarm in aws_cloudwatch_metric_alarm.function : alarm.alarm_name],
      [for alarm in aws_cloudwatch_metric_alarm.error_rate : alarm.alarm_name],
      [for alarm in aws_cloudwatch_metric_alarm.unhandled : alarm.alarm_name],
      [for alarm in aws_cloudwatch_metric_alarm.queue : alarm.alarm_name],
      aws_cloudwatch_metric_alarm.sweep[*].alarm_name,
      )) == toset(concat(
      [for pair in setproduct(["render", "assemble"], ["old-events", "dropped-events", "undelivered-failures"]) : "demo-${pair[0]}-${pair[1]}"],
      [for pair in setproduct(["render", "assemble", "record"], ["error-rate", "throttles", "near-timeouts", "unhandled"]) : "demo-${pair[0]}-${pair[1]}"],
      ["demo-old-failures", "demo-dead-letters", "demo-missed-sweeps"],
    ))
    error_message = "there must be these alarms"
  }
  assert {
    condition = sum([
      length(aws_cloudwatch_metric_alarm.function), 2 * length(aws_cloudwatch_metric_alarm.error_rate),
      length(aws_cloudwatch_metric_alarm.unhandled), length(aws_cloudwatch_metric_alarm.queue),
      length(aws_cloudwatch_metric_alarm.sweep),
    ]) == 24
    error_message = "`rayfold cost` estimates 24 metrics: change it and docs/cost.md too"
  }
  assert {
    condition = {
      for key, alarm in aws_cloudwatch_metric_alarm.function : key => [alarm.namespace, alarm.metric_name, alarm.statistic, alarm.threshold, alarm.evaluation_periods]
      } == {
      render-throttles              = ["AWS/Lambda", "Throttles", "Sum", 1, 3]
      render-near-timeouts          = ["AWS/Lambda", "Duration", "Maximum", 270000, 1]
      render-old-events             = ["AWS/Lambda", "AsyncEventAge", "Maximum", 3600000, 1]
      render-dropped-events         = ["AWS/Lambda", "AsyncEventsDropped", "Sum", 1, 1]
      render-undelivered-failures   = ["AWS/Lambda", "DestinationDeliveryFailures", "Sum", 1, 1]
      assemble-throttles            = ["AWS/Lambda", "Throttles", "Sum", 1, 3]
      assemble-near-timeouts        = ["AWS/Lambda", "Duration", "Maximum", 810000, 1]
      assemble-old-events           = ["AWS/Lambda", "AsyncEventAge", "Maximum", 3600000, 1]
      assemble-dropped-events       = ["AWS/Lambda", "AsyncEventsDropped", "Sum", 1, 1]
      assemble-undelivered-failures = ["AWS/Lambda", "DestinationDeliveryFailures", "Sum", 1, 1]
      record-throttles              = ["AWS/Lambda", "Throttles", "Sum", 1, 3]
      record-near-timeouts          = ["AWS/Lambda", "Duration", "Maximum", 54000, 1]
    }
    error_message = "what the alarms look at"
  }
  assert {
    condition = alltrue([for key, alarm in aws_cloudwatch_metric_alarm.function : alltrue([
      alarm.dimensions == tomap({ FunctionName = "demo-${split("-", key)[0]}" }),
      alarm.treat_missing_data == "notBreaching",
      alarm.comparison_operator == "GreaterThanOrEqualToThreshold",
    ])])
    error_message = "each alarm must look at its own function, and be quiet while nothing happens"
  }
}

run "no_alarm_for_retries_that_succeed" {
  assert {
    condition = alltrue([for key, alarm in aws_cloudwatch_metric_alarm.error_rate : alltrue([
      [for query in alarm.metric_query : query.expression if query.return_data == true] == ["100 * errors / invocations"],
      { for query in alarm.metric_query : query.id => one(query.metric).metric_name if query.id != "percent" } == { errors = "Errors", invocations = "Invocations" },
      alltrue([for query in alarm.metric_query : one(query.metric).dimensions == tomap({ FunctionName = "demo-${key}" }) if query.id != "percent"]),
      alarm.threshold == 10,
      alarm.datapoints_to_alarm == 3,
      alarm.treat_missing_data == "notBreaching",
    ])]) && length(aws_cloudwatch_metric_alarm.error_rate) == 3
    error_message = "errors must be many, and last: one that a retry makes good is none"
  }
  assert {
    condition     = alltrue([for alarm in aws_cloudwatch_metric_alarm.function : alarm.metric_name != "Errors"])
    error_message = "no alarm may count single errors"
  }
}

run "what_nothing_handles_reaches_an_alarm" {
  assert {
    condition = alltrue([for key, filter in aws_cloudwatch_log_metric_filter.unhandled : alltrue([
      filter.log_group_name == "/aws/lambda/demo-${key}",
      filter.pattern == "{ $.unhandled IS TRUE }",
      one(filter.metric_transformation).namespace == aws_cloudwatch_metric_alarm.unhandled[key].namespace,
      one(filter.metric_transformation).name == aws_cloudwatch_metric_alarm.unhandled[key].metric_name,
      aws_cloudwatch_metric_alarm.unhandled[key].threshold == 1,
    ])]) && keys(aws_cloudwatch_metric_alarm.unhandled) == ["assemble", "record", "render"]
    error_message = "a line with `unhandled` must set off the alarm of its function"
  }
  assert {
    condition = {
      for key, alarm in aws_cloudwatch_metric_alarm.queue : key => [alarm.namespace, alarm.metric_name, alarm.statistic, alarm.dimensions["QueueName"], alarm.threshold]
      } == {
      old-failures = ["AWS/SQS", "ApproximateAgeOfOldestMessage", "Maximum", "demo-failures", 1800]
      dead-letters = ["AWS/SQS", "ApproximateNumberOfMessagesVisible", "Maximum", "demo-dead-letters", 1]
    }
    error_message = "one dead letter, and a failed event that nobody writes down, must set off their alarms"
  }
}

run "a_sweep_that_does_not_run_sets_off_an_alarm" {
  assert {
    condition = alltrue([for alarm in aws_cloudwatch_metric_alarm.sweep : alltrue([
      alarm.namespace == "AWS/Scheduler",
      alarm.metric_name == "InvocationAttemptCount",
      alarm.dimensions == tomap({ ScheduleGroup = "demo" }),
      alarm.comparison_operator == "LessThanThreshold",
      alarm.threshold == 1,
      alarm.period == 900,
      alarm.evaluation_periods == 2,
      alarm.treat_missing_data == "breaching",
    ])]) && length(aws_cloudwatch_metric_alarm.sweep) == 1
    error_message = "silence of the schedule must raise an alarm"
  }
}

run "each_alarm_says_what_to_do" {
  assert {
    condition = alltrue([for alarm in concat(
      values(aws_cloudwatch_metric_alarm.function), values(aws_cloudwatch_metric_alarm.error_rate),
      values(aws_cloudwatch_metric_alarm.unhandled), values(aws_cloudwatch_metric_alarm.queue),
      [for alarm in aws_cloudwatch_metric_alarm.sweep : alarm],
    ) : can(regex("What to do: infra/terraform/RUNBOOK.md#[a-z-]+$", alarm.alarm_description))])
    error_message = "each alarm must name its place in the runbook"
  }
  assert {
    condition = alltrue([for alarm in concat(
      values(aws_cloudwatch_metric_alarm.function), values(aws_cloudwatch_metric_alarm.error_rate),
      values(aws_cloudwatch_metric_alarm.unhandled), values(aws_cloudwatch_metric_alarm.queue),
      [for alarm in aws_cloudwatch_metric_alarm.sweep : alarm],
    ) : strcontains(file("RUNBOOK.md"), "\n## ${regex("#([a-z-]+)$", alarm.alarm_description)[0]}\n")])
    error_message = "the runbook must have the heading that each alarm names"
  }
}

run "dashboard" {
  assert {
    condition     = one(aws_cloudwatch_dashboard.this[*].dashboard_name) == "demo-eu-central-1" && length(jsondecode(one(aws_cloudwatch_dashboard.this[*].dashboard_body)).widgets) == 8
    error_message = "there must be a dashboard of eight widgets"
  }
  assert {
    condition = toset(flatten([
      for widget in jsondecode(one(aws_cloudwatch_dashboard.this[*].dashboard_body)).widgets : [for metric in widget.properties.metrics : metric[3]]
      if widget.type == "metric"
    ])) == toset(["demo-render", "demo-assemble", "demo-record", "demo-failures", "demo-dead-letters"])
    error_message = "the graphs must show all functions and both queues"
  }
  assert {
    condition = alltrue([
      for widget in jsondecode(one(aws_cloudwatch_dashboard.this[*].dashboard_body)).widgets :
      widget.properties.region == "eu-central-1" && widget.x + widget.width <= 24
    ])
    error_message = "every widget must look at the stack's region and fit the page"
  }
}

run "the_dashboard_shows_timeouts_and_lack_of_memory" {
  assert {
    condition = alltrue([
      for widget in jsondecode(one(aws_cloudwatch_dashboard.this[*].dashboard_body)).widgets :
      strcontains(widget.properties.query, "level in ['WARN', 'ERROR'] or record.status in ['error', 'failure', 'timeout']")
      if widget.type == "log"
    ])
    error_message = "of what the platform ends only the platform tells"
  }
}

run "outputs" {
  assert {
    condition     = output.bucket == "demo-123456789012-eu-central-1" && output.bucket_arn == "arn:aws:s3:::demo-123456789012-eu-central-1"
    error_message = "bucket"
  }
  assert {
    condition     = output.sync_command == "aws s3 sync FOLDER s3://demo-123456789012-eu-central-1/scripts/FOLDER/ --region eu-central-1"
    error_message = output.sync_command
  }
  assert {
    condition     = output.submit_command == "AWS_REGION=eu-central-1 rayfold submit FOLDER --bucket demo-123456789012-eu-central-1"
    error_message = output.submit_command
  }
  assert {
    condition = alltrue([
      output.function_names == { render = "demo-render", assemble = "demo-assemble", record = "demo-record" },
      output.function_arns == {
        render   = "arn:aws:lambda:eu-central-1:123456789012:function:demo-render"
        assemble = "arn:aws:lambda:eu-central-1:123456789012:function:demo-assemble"
        record   = "arn:aws:lambda:eu-central-1:123456789012:function:demo-record"
      },
      output.role_arns == {
        render   = "arn:aws:iam::123456789012:role/demo-eu-central-1-render"
        assemble = "arn:aws:iam::123456789012:role/demo-eu-central-1-assemble"
        record   = "arn:aws:iam::123456789012:role/demo-eu-central-1-record"
      },
      output.log_group_names == { render = "/aws/lambda/demo-render", assemble = "/aws/lambda/demo-assemble", record = "/aws/lambda/demo-record" },
      output.failure_queue_url == "https://sqs.eu-central-1.amazonaws.com/123456789012/demo-failures",
      output.dead_letter_queue_url == "https://sqs.eu-central-1.amazonaws.com/123456789012/demo-dead-letters",
      output.dashboard_url == "https://eu-central-1.console.aws.amazon.com/cloudwatch/home?region=eu-central-1#dashboards/dashboard/demo-eu-central-1",
    ])
    error_message = "names and addresses of what was made"
  }
}

run "tags" {
  assert {
    condition = alltrue([for tags in concat(
      [for resource in aws_lambda_function.this : resource.tags],
      [for resource in aws_cloudwatch_log_group.this : resource.tags],
      [for resource in aws_iam_role.function : resource.tags],
      [for resource in aws_cloudwatch_metric_alarm.function : resource.tags],
      [for resource in aws_cloudwatch_metric_alarm.error_rate : resource.tags],
      [for resource in aws_cloudwatch_metric_alarm.unhandled : resource.tags],
      [for resource in aws_cloudwatch_metric_alarm.queue : resource.tags],
      aws_cloudwatch_metric_alarm.sweep[*].tags,
      [aws_s3_bucket.this[0].tags, aws_sqs_queue.failures.tags, aws_sqs_queue.dead_letters.tags, aws_iam_role.scheduler.tags],
    ) : tags == tomap({ Application = "demo" })])
    error_message = "everything must say which stack it belongs to"
  }
}
