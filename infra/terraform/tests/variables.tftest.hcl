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
        [aws_sqs_queue.failures.name, aws_sqs_queue.dead_letters.name, aws_s3_bucket.this[0].bucket],
        aws_cloudwatch_dashboard.this[*].dashboard_name,
        [for alarm in aws_cloudwatch_metric_alarm.function : alarm.alarm_name],
        [for alarm in aws_cloudwatch_metric_alarm.queue : alarm.alarm_name],
        [for alarm in aws_cloudwatch_metric_alarm.error_rate : alarm.alarm_name],
        [for alarm in aws_cloudwatch_metric_alarm.unhandled : alarm.alarm_name],
        aws_cloudwatch_metric_alarm.sweep[*].alarm_name,
      ) : startswith(trimprefix(name, "/aws/lambda/"), "film-2")
    ]) == toset([true])
    error_message = "two stacks in one account must not share a name"
  }
  assert {
    condition     = aws_s3_bucket.this[0].tags["Application"] == "film-2"
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
      length(aws_s3_bucket.this[0].bucket) <= 63,
      length("${var.name}-123456789012-ap-southeast-1") <= 63,
      alltrue([for function in aws_lambda_function.this : length(function.function_name) <= 64]),
      length("${var.name}-ap-southeast-1-sweep-schedule") <= 64,
      alltrue([for role in aws_iam_role.function : length(role.name) <= 64]),
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
    condition     = aws_s3_bucket.this[0].tags == tomap({ Application = "mine", Team = "film" }) && aws_lambda_function.this["render"].tags == aws_s3_bucket.this[0].tags
    error_message = "the caller's tags must be there, and win"
  }
}

run "bucket_name" {
  variables {
    bucket_name = "films-of-mine"
  }

  assert {
    condition     = aws_s3_bucket.this[0].bucket == "films-of-mine" && output.bucket == "films-of-mine"
    error_message = "the bucket must have the name given"
  }
  assert {
    condition     = alltrue([for function in aws_lambda_function.this : one(function.environment).variables["RAYFOLD_BUCKET"] == "films-of-mine"])
    error_message = "the functions must get the name given"
  }
}

run "existing_bucket" {
  variables {
    existing_bucket = "of-mine"
  }

  assert {
    condition     = output.bucket == "of-mine" && output.bucket_arn == "arn:aws:s3:::of-mine" && aws_s3_bucket_notification.this.bucket == "of-mine"
    error_message = "the bucket that was given must be used"
  }
  assert {
    condition = alltrue([for count in [
      length(aws_s3_bucket.this), length(aws_s3_bucket_ownership_controls.this), length(aws_s3_bucket_public_access_block.this),
      length(aws_s3_bucket_policy.this), length(aws_s3_bucket_server_side_encryption_configuration.this),
      length(aws_s3_bucket_versioning.this), length(aws_s3_bucket_lifecycle_configuration.this),
      length(aws_s3_bucket_logging.this), length(terraform_data.bucket_must_be_empty),
    ] : count == 0])
    error_message = "a bucket that was given keeps its settings, and the stack's end is not its end"
  }
  assert {
    condition = alltrue(flatten([for policy in aws_iam_role_policy.objects : [
      for statement in jsondecode(policy.policy).Statement : [
        for resource in flatten([statement.Resource]) : startswith(resource, "arn:aws:s3:::of-mine")
      ]
    ]]))
    error_message = "the functions' rights must be on that bucket"
  }
}

run "existing_bucket_with_settings_of_a_new_one" {
  command = plan
  variables {
    existing_bucket = "of-mine"
    force_destroy   = true
  }
  expect_failures = [var.existing_bucket]
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
    condition     = aws_s3_bucket.this[0].force_destroy == true
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
      for rule in aws_s3_bucket_lifecycle_configuration.this[0].rule : one(rule.filter).prefix => one(rule.noncurrent_version_expiration).noncurrent_days
      if length(rule.noncurrent_version_expiration) > 0
      } == {
      "scripts/" = 90, "animations/" = 90, "parts/" = 1, "frames/" = 1, "manifests/" = 1, "assemblies/" = 1, "retries/" = 1, "checkpoints/" = 1
    }
    error_message = "people's objects are kept for longer, the pipeline's own are not"
  }
  assert {
    condition = {
      for rule in aws_s3_bucket_lifecycle_configuration.this[0].rule : one(rule.filter).prefix => one(rule.expiration).days
      if startswith(rule.id, "spent-")
    } == { "assemblies/" = 2, "retries/" = 2, "checkpoints/" = 1 }
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

run "kms_key_arn" {
  # A queue that was made without the key keeps what it had in the state of the runs before.
  state_key = "with-key"

  variables {
    kms_key_arn = "arn:aws:kms:eu-central-1:123456789012:key/11111111-2222-3333-4444-555555555555"
  }

  assert {
    condition = alltrue([
      for rule in aws_s3_bucket_server_side_encryption_configuration.this[0].rule : alltrue([
        rule.bucket_key_enabled,
        one(rule.apply_server_side_encryption_by_default).sse_algorithm == "aws:kms",
        one(rule.apply_server_side_encryption_by_default).kms_master_key_id == var.kms_key_arn,
      ])
    ])
    error_message = "the bucket must use the key, by way of a bucket key: a request to KMS for each object would be billed"
  }
  assert {
    condition = alltrue([for key in concat(
      [for queue in [aws_sqs_queue.failures, aws_sqs_queue.dead_letters] : queue.kms_master_key_id],
      [for group in aws_cloudwatch_log_group.this : group.kms_key_id],
      [for function in aws_lambda_function.this : function.kms_key_arn],
    ) : key == var.kms_key_arn])
    error_message = "queues, logs and the functions' settings must use the key"
  }
  assert {
    condition     = aws_sqs_queue.failures.sqs_managed_sse_enabled != true && aws_sqs_queue.dead_letters.sqs_managed_sse_enabled != true
    error_message = "SQS takes one of the two kinds of encryption, not both"
  }
}

run "the_key_outlives_the_stack" {
  state_key = "with-key"

  variables {
    kms_key_arn = "arn:aws:kms:eu-central-1:123456789012:key/11111111-2222-3333-4444-555555555555"
  }

  assert {
    condition = alltrue([
      strcontains(file("examples/key/main.tf"), "prevent_destroy = true"),
      !strcontains(join("", [for source in fileset(".", "*.tf") : file(source)]), "resource \"aws_kms_key\""),
      var.kms_key_arn != null,
    ])
    error_message = "the stack may hold no key, and the key's own configuration may not destroy it"
  }
}

run "kms_key_arn_alias" {
  command = plan
  variables {
    kms_key_arn = "arn:aws:kms:eu-central-1:123456789012:alias/demo"
  }
  expect_failures = [var.kms_key_arn]
}

run "former_kms_key_arns_no_key" {
  command = plan
  variables {
    former_kms_key_arns = ["demo"]
  }
  expect_failures = [var.former_kms_key_arns]
}

run "bucket_policy_statements" {
  variables {
    bucket_policy_statements = [
      { Sid = "Auditors", Effect = "Allow", Principal = { AWS = "123456789013" }, Action = "s3:ListBucket", Resource = "*" },
      { Sid = "NotFromOutside", Effect = "Deny", Principal = "*", Action = ["s3:GetObject"], Resource = ["*"], Condition = { Null = { "aws:SourceVpce" = "true" } } },
    ]
  }

  assert {
    condition     = [for statement in jsondecode(aws_s3_bucket_policy.this[0].policy).Statement : statement.Sid] == ["TlsOnly", "Tls12OrNewer", "Auditors", "NotFromOutside"]
    error_message = "the statements given must be added to the stack's own"
  }
}

run "bucket_policy_statements_without_effect" {
  command = plan
  variables {
    bucket_policy_statements = [{ Sid = "Auditors" }]
  }
  expect_failures = [var.bucket_policy_statements]
}

run "events_of_finished_gifs" {
  variables {
    eventbridge_enabled = true
    finished_topic_arn  = "arn:aws:sns:eu-central-1:123456789012:films"
  }

  assert {
    condition     = aws_s3_bucket_notification.this.eventbridge
    error_message = "EventBridge must get the events"
  }
  assert {
    condition = alltrue([for topic in aws_s3_bucket_notification.this.topic : alltrue([
      topic.topic_arn == "arn:aws:sns:eu-central-1:123456789012:films",
      topic.events == toset(["s3:ObjectCreated:*"]),
      topic.filter_prefix == "animations/",
    ])]) && length(aws_s3_bucket_notification.this.topic) == 1
    error_message = "the topic must get the events of GIFs, and no others"
  }
  assert {
    condition     = length(aws_s3_bucket_notification.this.lambda_function) == length(jsondecode(file("routes.json")).routes)
    error_message = "the functions must keep their events"
  }
}

run "finished_topic_arn_no_topic" {
  command = plan
  variables {
    finished_topic_arn = "films"
  }
  expect_failures = [var.finished_topic_arn]
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
      if key != "record"
    } == { render = [3538, 120, 1024, 500], assemble = [10240, 600, 2048, 5] }
    error_message = "the functions must have the sizes given"
  }
  assert {
    condition     = aws_cloudwatch_metric_alarm.function["render-near-timeouts"].threshold == 108000 && aws_cloudwatch_metric_alarm.function["assemble-near-timeouts"].threshold == 540000
    error_message = "the alarms must follow the timeouts"
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
    assemble = { reserved_concurrency = 1 }
  }
  expect_failures = [var.assemble]
}

run "permissions_boundary" {
  variables {
    permissions_boundary_arn = "arn:aws:iam::123456789012:policy/bound"
  }

  assert {
    condition = alltrue([
      for role in concat(values(aws_iam_role.function), [aws_iam_role.scheduler]) :
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
    condition = alltrue([
      length(aws_cloudwatch_metric_alarm.function) == 0,
      length(aws_cloudwatch_metric_alarm.error_rate) == 0,
      length(aws_cloudwatch_metric_alarm.unhandled) == 0,
      length(aws_cloudwatch_log_metric_filter.unhandled) == 0,
      length(aws_cloudwatch_metric_alarm.queue) == 0,
      length(aws_cloudwatch_metric_alarm.sweep) == 0,
      length(aws_cloudwatch_dashboard.this) == 0,
    ])
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
      for alarm in concat(
        [for alarm in aws_cloudwatch_metric_alarm.function : { to = alarm.alarm_actions, over = alarm.ok_actions }],
        [for alarm in aws_cloudwatch_metric_alarm.error_rate : { to = alarm.alarm_actions, over = alarm.ok_actions }],
        [for alarm in aws_cloudwatch_metric_alarm.unhandled : { to = alarm.alarm_actions, over = alarm.ok_actions }],
        [for alarm in aws_cloudwatch_metric_alarm.queue : { to = alarm.alarm_actions, over = alarm.ok_actions }],
        [for alarm in aws_cloudwatch_metric_alarm.sweep : { to = alarm.alarm_actions, over = alarm.ok_actions }],
      ) :
      alarm.to == toset(["arn:aws:sns:eu-central-1:123456789012:oncall"]) && alarm.over == alarm.to
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

run "record" {
  variables {
    record = { memory_mb = 1024, timeout_s = 30 }
  }

  assert {
    condition     = aws_lambda_function.this["record"].memory_size == 1024 && aws_lambda_function.this["record"].timeout == 30
    error_message = "the record function must have the size given"
  }
  assert {
    condition     = aws_sqs_queue.failures.visibility_timeout_seconds == 180
    error_message = "the failure queue must wait six times the record function's timeout"
  }
}

run "record_memory_too_small" {
  command = plan
  variables {
    record = { memory_mb = 64 }
  }
  expect_failures = [var.record]
}

run "record_timeout_too_long" {
  command = plan
  variables {
    record = { timeout_s = 901 }
  }
  expect_failures = [var.record]
}

run "limits" {
  variables {
    limits = {
      max_animation_frames = 70
      max_bands            = 6
      max_frames           = 50
      max_pixels           = 1000000
      max_objects          = 2000
      max_lights           = 4
      max_script_bytes     = 1048576
    }
  }

  assert {
    condition = {
      for name, value in aws_lambda_function.this["render"].environment[0].variables : name => value if name != "RAYFOLD_BUCKET"
      } == {
      RAYFOLD_MAX_ANIMATION_FRAMES = "70"
      RAYFOLD_MAX_BANDS            = "6"
      RAYFOLD_MAX_FRAMES           = "50"
      RAYFOLD_MAX_LIGHTS           = "4"
      RAYFOLD_MAX_OBJECTS          = "2000"
      RAYFOLD_MAX_PIXELS           = "1000000"
      RAYFOLD_MAX_SCRIPT_BYTES     = "1048576"
    }
    error_message = "the render function must get the limits given"
  }
}

run "limits_follow_the_memory" {
  variables {
    render = { memory_mb = 1024 }
  }

  assert {
    condition = [
      for name in ["RAYFOLD_MAX_OBJECTS", "RAYFOLD_MAX_PIXELS"] : aws_lambda_function.this["render"].environment[0].variables[name]
    ] == ["550800", "51200000"]
    error_message = "a smaller function must take smaller scenes"
  }
}

run "limits_with_much_memory" {
  variables {
    render = { memory_mb = 10240 }
  }

  assert {
    condition = [
      for name in ["RAYFOLD_MAX_OBJECTS", "RAYFOLD_MAX_PIXELS"] : aws_lambda_function.this["render"].environment[0].variables[name]
    ] == ["4000000", "64000000"]
    error_message = "more than the language's own limits is not asked for"
  }
}

run "limits_zero" {
  command = plan
  variables {
    limits = { max_objects = 0 }
  }
  expect_failures = [var.limits]
}

run "vpc" {
  variables {
    vpc = {
      subnet_ids         = ["subnet-1", "subnet-2"]
      security_group_ids = ["sg-1"]
    }
  }

  assert {
    condition = alltrue([for function in aws_lambda_function.this : alltrue([
      one(function.vpc_config).subnet_ids == toset(["subnet-1", "subnet-2"]),
      one(function.vpc_config).security_group_ids == toset(["sg-1"]),
    ])])
    error_message = "every function must be in the VPC"
  }
  assert {
    condition = alltrue([for function, policy in aws_iam_role_policy.platform : {
      for statement in jsondecode(policy.policy).Statement : statement.Sid => [statement.Effect, try(statement.Condition.ArnEquals["lambda:SourceFunctionArn"], "")]
      if contains(["BeInTheVpc", "OnlyLambdaItself"], statement.Sid)
      } == {
      BeInTheVpc       = ["Allow", ""]
      OnlyLambdaItself = ["Deny", "arn:aws:lambda:eu-central-1:123456789012:function:demo-${function}"]
    }])
    error_message = "Lambda may make network interfaces, the functions' code may not"
  }
}

run "vpc_without_subnets" {
  command = plan
  variables {
    vpc = { subnet_ids = [], security_group_ids = ["sg-1"] }
  }
  expect_failures = [var.vpc]
}

run "code_signing_config_arn" {
  variables {
    code_signing_config_arn = "arn:aws:lambda:eu-central-1:123456789012:code-signing-config:csc-1"
  }

  assert {
    condition     = alltrue([for function in aws_lambda_function.this : function.code_signing_config_arn == "arn:aws:lambda:eu-central-1:123456789012:code-signing-config:csc-1"])
    error_message = "every function must ask for the signature"
  }
}

run "code_signing_config_arn_no_config" {
  command = plan
  variables {
    code_signing_config_arn = "signed"
  }
  expect_failures = [var.code_signing_config_arn]
}

run "role_path" {
  variables {
    role_path = "/films/"
  }

  assert {
    condition     = alltrue([for role in concat(values(aws_iam_role.function), [aws_iam_role.scheduler]) : role.path == "/films/"])
    error_message = "every role must have the path"
  }
}

run "role_path_without_slashes" {
  command = plan
  variables {
    role_path = "films"
  }
  expect_failures = [var.role_path]
}

run "alarm_thresholds" {
  variables {
    alarm_thresholds = {
      error_percent    = 20
      throttles        = 5
      duration_percent = 50
      event_age_s      = 60
      failure_age_s    = 120
      dropped_events   = 3
      unhandled        = 4
      dead_letters     = 2
    }
  }

  assert {
    condition = {
      for key in ["throttles", "near-timeouts", "old-events", "dropped-events"] : key => aws_cloudwatch_metric_alarm.function["render-${key}"].threshold
    } == { throttles = 5, near-timeouts = 150000, old-events = 60000, dropped-events = 3 }
    error_message = "the functions' alarms must go off from the thresholds given"
  }
  assert {
    condition = [
      aws_cloudwatch_metric_alarm.error_rate["render"].threshold,
      aws_cloudwatch_metric_alarm.unhandled["render"].threshold,
      aws_cloudwatch_metric_alarm.queue["old-failures"].threshold,
      aws_cloudwatch_metric_alarm.queue["dead-letters"].threshold,
    ] == [20, 4, 120, 2]
    error_message = "the other alarms must go off from the thresholds given"
  }
}

run "alarm_thresholds_zero" {
  command = plan
  variables {
    alarm_thresholds = { dead_letters = 0 }
  }
  expect_failures = [var.alarm_thresholds]
}

run "alarm_thresholds_above_all" {
  command = plan
  variables {
    alarm_thresholds = { error_percent = 101 }
  }
  expect_failures = [var.alarm_thresholds]
}

run "runbook_url" {
  variables {
    runbook_url = "https://wiki.example.com/films"
  }

  assert {
    condition     = endswith(aws_cloudwatch_metric_alarm.function["render-throttles"].alarm_description, "What to do: https://wiki.example.com/films#throttles")
    error_message = aws_cloudwatch_metric_alarm.function["render-throttles"].alarm_description
  }
}

run "budget" {
  variables {
    budget = {
      monthly_usd = 20
      emails      = ["me@example.com"]
      topic_arns  = ["arn:aws:sns:eu-central-1:123456789012:oncall"]
    }
  }

  assert {
    condition = alltrue([for budget in aws_budgets_budget.this : alltrue([
      budget.name == "demo-eu-central-1",
      budget.limit_amount == "20",
      budget.limit_unit == "USD",
      budget.time_unit == "MONTHLY",
      { for filter in budget.cost_filter : filter.name => one(filter.values) } == {
        TagKeyValue = "user:Application$demo"
        Region      = "eu-central-1"
      },
    ])]) && length(aws_budgets_budget.this) == 1
    error_message = "the budget must be the stack's"
  }
  assert {
    condition = {
      for notification in one(aws_budgets_budget.this[*].notification) : notification.notification_type => [
        notification.threshold, one(notification.subscriber_email_addresses), one(notification.subscriber_sns_topic_arns)
      ]
      } == {
      ACTUAL     = [80, "me@example.com", "arn:aws:sns:eu-central-1:123456789012:oncall"]
      FORECASTED = [100, "me@example.com", "arn:aws:sns:eu-central-1:123456789012:oncall"]
    }
    error_message = "all recipients must get a message before the money is gone"
  }
}

run "budget_that_tells_nobody" {
  command = plan
  variables {
    budget = { monthly_usd = 20 }
  }
  expect_failures = [var.budget]
}

run "two_regions_share_an_account" {
  override_data {
    target = data.aws_region.current
    values = { region = "us-east-1" }
  }

  assert {
    condition = alltrue([for name in concat(
      [for role in aws_iam_role.function : role.name],
      [aws_iam_role.scheduler.name, one(aws_cloudwatch_dashboard.this[*].dashboard_name)],
    ) : startswith(name, "demo-us-east-1")])
    error_message = "what is global to the account must be named for the region"
  }
}
