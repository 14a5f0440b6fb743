# What each variable changes, and what it refuses. Each value differs from the default.

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

run "name" {
  variables {
    name = "film-2"
  }

  assert {
    condition = toset([
      for name in concat(
        [for function in aws_lambda_function.this : function.function_name],
        [for group in aws_cloudwatch_log_group.this : group.name],
        [for role in aws_iam_role.function : role.name],
        [aws_iam_role.scheduler.name, aws_scheduler_schedule.sweep.name, aws_scheduler_schedule_group.this.name],
        [aws_sqs_queue.failures.name, aws_sqs_queue.dead_letters.name, aws_s3_bucket.this.bucket],
        aws_cloudwatch_dashboard.this[*].dashboard_name,
        [for alarm in aws_cloudwatch_metric_alarm.function : alarm.alarm_name],
        aws_cloudwatch_metric_alarm.dead_letters[*].alarm_name,
      ) : startswith(trimprefix(name, "/aws/lambda/"), "film-2")
    ]) == toset([true])
    error_message = "two stacks in one account must not share a name"
  }
  assert {
    condition     = aws_s3_bucket.this.tags["Application"] == "film-2"
    error_message = "the tag must name the stack"
  }
}

run "name_too_short" {
  command = plan
  variables {
    name = "ab"
  }
  expect_failures = [var.name]
}

run "name_too_long" {
  command = plan
  variables {
    name = "a23456789012345678901234567890123"
  }
  expect_failures = [var.name]
}

run "name_with_capitals" {
  command = plan
  variables {
    name = "Demo"
  }
  expect_failures = [var.name]
}

run "name_with_two_hyphens" {
  command = plan
  variables {
    name = "my--demo"
  }
  expect_failures = [var.name]
}

run "longest_names_fit" {
  command = plan
  variables {
    name = "a2345678901234567890123456789012"
  }

  assert {
    condition = alltrue([
      length(aws_s3_bucket.this.bucket) <= 63,
      length("${var.name}-123456789012-ap-southeast-1") <= 63,
      alltrue([for function in aws_lambda_function.this : length(function.function_name) <= 64]),
      length(aws_iam_role.scheduler.name) <= 64,
      length(aws_scheduler_schedule.sweep.name) <= 64,
    ])
    error_message = "the longest name must keep within AWS's limits"
  }
}

run "tags" {
  variables {
    tags = { Team = "film", Application = "mine" }
  }

  assert {
    condition     = aws_s3_bucket.this.tags == tomap({ Application = "mine", Team = "film" }) && aws_lambda_function.this["render"].tags == aws_s3_bucket.this.tags
    error_message = "the caller's tags must be there, and win"
  }
}

run "bucket_name" {
  variables {
    bucket_name = "films-of-mine"
  }

  assert {
    condition     = aws_s3_bucket.this.bucket == "films-of-mine" && output.bucket == "films-of-mine"
    error_message = "the bucket must have the name given"
  }
  assert {
    condition     = alltrue([for function in aws_lambda_function.this : one(function.environment).variables["RAYFOLD_BUCKET"] == "films-of-mine"])
    error_message = "the functions must be told the name given"
  }
}

run "bucket_name_with_dots" {
  command = plan
  variables {
    bucket_name = "films.of.mine"
  }
  expect_failures = [var.bucket_name]
}

run "force_destroy" {
  variables {
    force_destroy = true
  }

  assert {
    condition     = aws_s3_bucket.this.force_destroy == true
    error_message = "destroying must then take the objects too"
  }
}

run "retention" {
  variables {
    noncurrent_version_days = 90
    claim_days              = 2
    log_retention_days      = 365
  }

  assert {
    condition = {
      for rule in aws_s3_bucket_lifecycle_configuration.this.rule : one(rule.filter).prefix => one(rule.noncurrent_version_expiration).noncurrent_days
      if length(rule.noncurrent_version_expiration) > 0
      } == {
      "scripts/" = 90, "animations/" = 90, "parts/" = 1, "frames/" = 1, "manifests/" = 1, "assemblies/" = 1, "retries/" = 1
    }
    error_message = "people's objects are kept for longer, the pipeline's own are not"
  }
  assert {
    condition = {
      for rule in aws_s3_bucket_lifecycle_configuration.this.rule : one(rule.filter).prefix => one(rule.expiration).days
      if startswith(rule.id, "spent-")
    } == { "assemblies/" = 2, "retries/" = 2 }
    error_message = "claims and retry orders must expire after the days given"
  }
  assert {
    condition     = alltrue([for group in aws_cloudwatch_log_group.this : group.retention_in_days == 365])
    error_message = "logs must be kept for the days given"
  }
}

run "noncurrent_version_days_zero" {
  command = plan
  variables {
    noncurrent_version_days = 0
  }
  expect_failures = [var.noncurrent_version_days]
}

run "claim_days_zero" {
  command = plan
  variables {
    claim_days = 0
  }
  expect_failures = [var.claim_days]
}

run "log_retention_days_unknown_to_cloudwatch" {
  command = plan
  variables {
    log_retention_days = 31
  }
  expect_failures = [var.log_retention_days]
}

run "access_log" {
  variables {
    access_log_bucket = "all-logs"
    access_log_prefix = "films/"
  }

  assert {
    condition     = one(aws_s3_bucket_logging.this[*].target_bucket) == "all-logs" && one(aws_s3_bucket_logging.this[*].target_prefix) == "films/"
    error_message = "the access log must go where it was asked to"
  }
}

run "customer_managed_key" {
  # A queue that was made without the key keeps what it had in the state of the runs before.
  state_key = "with-key"

  variables {
    customer_managed_key = true
  }

  assert {
    condition     = one(aws_kms_key.this[*].enable_key_rotation) == true && one(aws_kms_key.this[*].deletion_window_in_days) == 30 && one(aws_kms_alias.this[*].name) == "alias/demo"
    error_message = "the key must rotate, be slow to go, and be found by name"
  }
  assert {
    condition = alltrue([
      for rule in aws_s3_bucket_server_side_encryption_configuration.this.rule : alltrue([
        rule.bucket_key_enabled,
        one(rule.apply_server_side_encryption_by_default).sse_algorithm == "aws:kms",
        one(rule.apply_server_side_encryption_by_default).kms_master_key_id == one(aws_kms_key.this[*].arn),
      ])
    ])
    error_message = "the bucket must use the key, by way of a bucket key: a request to KMS for each object would be billed"
  }
  assert {
    condition = alltrue([for key in concat(
      [for queue in [aws_sqs_queue.failures, aws_sqs_queue.dead_letters] : queue.kms_master_key_id],
      [for group in aws_cloudwatch_log_group.this : group.kms_key_id],
      [for function in aws_lambda_function.this : function.kms_key_arn],
      [output.kms_key_arn],
    ) : key == one(aws_kms_key.this[*].arn)])
    error_message = "queues, logs and the functions' settings must use the key"
  }
  assert {
    condition     = aws_sqs_queue.failures.sqs_managed_sse_enabled != true && aws_sqs_queue.dead_letters.sqs_managed_sse_enabled != true
    error_message = "SQS takes one of the two kinds of encryption, not both"
  }
}

run "architecture" {
  variables {
    architecture = "arm64"
  }

  assert {
    condition     = alltrue([for function in aws_lambda_function.this : function.architectures == tolist(["arm64"])])
    error_message = "both functions must run on the architecture given"
  }
}

run "architecture_unknown" {
  command = plan
  variables {
    architecture = "riscv64"
  }
  expect_failures = [var.architecture]
}

run "packages" {
  variables {
    packages = {
      render   = "tests/packages/rayfold-assemble.zip"
      assemble = "tests/packages/rayfold-render.zip"
    }
  }

  assert {
    condition = alltrue([
      aws_lambda_function.this["render"].filename == "tests/packages/rayfold-assemble.zip",
      aws_lambda_function.this["assemble"].filename == "tests/packages/rayfold-render.zip",
      aws_lambda_function.this["render"].source_code_hash == filebase64sha256("tests/packages/rayfold-assemble.zip"),
    ])
    error_message = "the functions must have the packages given"
  }
}

run "packages_missing" {
  command = plan
  variables {
    packages = {
      render   = "tests/packages/there-is-none.zip"
      assemble = "tests/packages/rayfold-assemble.zip"
    }
  }
  expect_failures = [aws_lambda_function.this["render"]]
}

run "sizes" {
  variables {
    render = {
      memory_mb            = 3538
      timeout_s            = 120
      tmp_mb               = 1024
      reserved_concurrency = 500
    }
    assemble = {
      memory_mb            = 10240
      timeout_s            = 600
      tmp_mb               = 2048
      reserved_concurrency = 5
    }
  }

  assert {
    condition = {
      for key, function in aws_lambda_function.this :
      key => [function.memory_size, function.timeout, one(function.ephemeral_storage).size, function.reserved_concurrent_executions]
    } == { render = [3538, 120, 1024, 500], assemble = [10240, 600, 2048, 5] }
    error_message = "the functions must have the sizes given"
  }
  assert {
    condition     = aws_cloudwatch_metric_alarm.function["render-near-timeouts"].threshold == 108000 && aws_cloudwatch_metric_alarm.function["assemble-near-timeouts"].threshold == 540000
    error_message = "the alarms must follow the timeouts"
  }
  assert {
    condition     = aws_sqs_queue.failures.visibility_timeout_seconds == 3600
    error_message = "the failure queue must wait six times the assemble function's timeout"
  }
}

run "one_size_keeps_the_other_defaults" {
  variables {
    render = { memory_mb = 2048 }
  }

  assert {
    condition     = aws_lambda_function.this["render"].memory_size == 2048 && aws_lambda_function.this["render"].timeout == 300
    error_message = "what is not given must keep its default"
  }
}

run "render_memory_too_small" {
  command = plan
  variables {
    render = { memory_mb = 127 }
  }
  expect_failures = [var.render]
}

run "render_timeout_too_long" {
  command = plan
  variables {
    render = { timeout_s = 901 }
  }
  expect_failures = [var.render]
}

run "render_tmp_too_large" {
  command = plan
  variables {
    render = { tmp_mb = 10241 }
  }
  expect_failures = [var.render]
}

run "render_stopped" {
  command = plan
  variables {
    render = { reserved_concurrency = 0 }
  }
  expect_failures = [var.render]
}

run "assemble_memory_too_large" {
  command = plan
  variables {
    assemble = { memory_mb = 10241 }
  }
  expect_failures = [var.assemble]
}

run "assemble_timeout_too_short" {
  command = plan
  variables {
    assemble = { timeout_s = 9 }
  }
  expect_failures = [var.assemble]
}

run "assemble_tmp_too_small" {
  command = plan
  variables {
    assemble = { tmp_mb = 511 }
  }
  expect_failures = [var.assemble]
}

run "assemble_without_room_for_claims" {
  command = plan
  variables {
    assemble = { reserved_concurrency = 2 }
  }
  expect_failures = [var.assemble]
}

run "permissions_boundary" {
  variables {
    permissions_boundary_arn = "arn:aws:iam::123456789012:policy/bound"
  }

  assert {
    condition = alltrue([
      for role in [aws_iam_role.function["render"], aws_iam_role.function["assemble"], aws_iam_role.scheduler] :
      role.permissions_boundary == "arn:aws:iam::123456789012:policy/bound"
    ])
    error_message = "every role must be bounded"
  }
}

run "permissions_boundary_no_policy" {
  command = plan
  variables {
    permissions_boundary_arn = "bound"
  }
  expect_failures = [var.permissions_boundary_arn]
}

run "xray_tracing" {
  variables {
    xray_tracing = false
  }

  assert {
    condition     = alltrue([for function in aws_lambda_function.this : one(function.tracing_config).mode == "PassThrough"])
    error_message = "no invocation may be sampled"
  }
  assert {
    condition     = alltrue([for policy in aws_iam_role_policy.platform : !strcontains(policy.policy, "xray")])
    error_message = "without traces there is no right to send any"
  }
}

run "log_level" {
  variables {
    log_level = "DEBUG"
  }

  assert {
    condition     = alltrue([for function in aws_lambda_function.this : one(function.logging_config).application_log_level == "DEBUG"])
    error_message = "the functions must log from the level given"
  }
}

run "log_level_unknown" {
  command = plan
  variables {
    log_level = "debug"
  }
  expect_failures = [var.log_level]
}

run "events" {
  variables {
    event_retries   = 0
    event_max_age_s = 3600
  }

  assert {
    condition = alltrue([
      for config in aws_lambda_function_event_invoke_config.this :
      config.maximum_retry_attempts == 0 && config.maximum_event_age_in_seconds == 3600
    ])
    error_message = "retries and age must be as given"
  }
}

run "event_retries_too_many" {
  command = plan
  variables {
    event_retries = 3
  }
  expect_failures = [var.event_retries]
}

run "event_max_age_too_old" {
  command = plan
  variables {
    event_max_age_s = 21601
  }
  expect_failures = [var.event_max_age_s]
}

run "sweep_minutes" {
  variables {
    sweep_minutes = 2
  }

  assert {
    condition     = aws_scheduler_schedule.sweep.schedule_expression == "rate(2 minutes)" && one(one(aws_scheduler_schedule.sweep.target).retry_policy).maximum_event_age_in_seconds == 60
    error_message = "the sweep must come as often as was asked, and not be tried after the next"
  }
}

run "sweep_minutes_one" {
  command = plan
  variables {
    sweep_minutes = 1
  }
  expect_failures = [var.sweep_minutes]
}

run "without_alarms_and_dashboard" {
  variables {
    alarms_enabled    = false
    dashboard_enabled = false
  }

  assert {
    condition     = length(aws_cloudwatch_metric_alarm.function) == 0 && length(aws_cloudwatch_metric_alarm.dead_letters) == 0 && length(aws_cloudwatch_dashboard.this) == 0
    error_message = "there must be neither"
  }
  assert {
    condition     = output.dashboard_url == null
    error_message = "there is no address of what is not there"
  }
}

run "alarm_actions" {
  variables {
    alarm_actions = ["arn:aws:sns:eu-central-1:123456789012:oncall"]
  }

  assert {
    condition = alltrue([
      for alarm in concat(values(aws_cloudwatch_metric_alarm.function), aws_cloudwatch_metric_alarm.dead_letters) :
      alarm.alarm_actions == toset(["arn:aws:sns:eu-central-1:123456789012:oncall"]) && alarm.ok_actions == alarm.alarm_actions
    ])
    error_message = "every alarm must tell whom it was asked to"
  }
}

run "alarm_actions_no_arn" {
  command = plan
  variables {
    alarm_actions = ["me@example.com"]
  }
  expect_failures = [var.alarm_actions]
}
