# The functions, their logs, and the events of the bucket that wake them.

locals {
  function_names  = { for function in keys(local.functions) : function => "${var.name}-${function}" }
  log_group_names = { for function, name in local.function_names : function => "/aws/lambda/${name}" }

  # Spelled out, as the roles name them and the functions, which need the roles, name the groups.
  log_group_arns = {
    for function, name in local.log_group_names :
    function => "arn:${local.partition}:logs:${local.region}:${local.account_id}:log-group:${name}"
  }
}

locals {
  # What a script may ask for. The defaults fit the render function's memory, as measured with spheres, boxes and
  # triangles: a megabyte holds 1,700 objects with their part of the script and of the search tree, and an image takes six
  # bytes a pixel with its PNG. What takes more, as with many samples, or too long, is drawn in bands.
  limits_of_scripts = {
    RAYFOLD_MAX_BANDS        = tostring(var.limits.max_bands)
    RAYFOLD_MAX_FRAMES       = tostring(var.limits.max_frames)
    RAYFOLD_MAX_LIGHTS       = tostring(var.limits.max_lights)
    RAYFOLD_MAX_SCRIPT_BYTES = tostring(var.limits.max_script_bytes)
    RAYFOLD_MAX_OBJECTS = tostring(coalesce(
      var.limits.max_objects,
      max(10000, min(4000000, (var.render.memory_mb - 700) * 1700)),
    ))
  }

  # What every function knows: those that assemble read frames, and all of them write manifests.
  limits_of_animations = {
    RAYFOLD_MAX_ANIMATION_FRAMES = tostring(var.limits.max_animation_frames)
    RAYFOLD_MAX_PIXELS = tostring(coalesce(
      var.limits.max_pixels,
      min(64000000, var.render.memory_mb * 50000),
    ))
  }
}

resource "aws_cloudwatch_log_group" "this" {
  #checkov:skip=CKV_AWS_158:The key is optional (kms_key_arn); the logs hold no script contents
  #checkov:skip=CKV_AWS_338:log_retention_days decides; what failed is written into the bucket, which does not expire
  for_each = local.log_group_names

  name              = each.value
  retention_in_days = var.log_retention_days
  kms_key_id        = var.kms_key_arn
  tags              = local.tags
}

resource "aws_lambda_function" "this" {
  #checkov:skip=CKV_AWS_115:Optional (reserved_concurrency): a new account can set none aside
  #checkov:skip=CKV_AWS_116:The on-failure destination takes the place of a dead-letter queue and says more: the error too
  #checkov:skip=CKV_AWS_117:Optional (vpc): the functions speak with AWS services only, and in a VPC need an endpoint for that
  #checkov:skip=CKV_AWS_272:Optional (code_signing_config_arn): the packages are built from this source by whoever applies it
  for_each = local.functions

  function_name = local.function_names[each.key]
  description   = each.value.description
  role          = aws_iam_role.function[each.key].arn

  package_type     = "Zip"
  runtime          = "provided.al2023"
  architectures    = [var.architecture]
  handler          = "bootstrap"
  filename         = local.packages[each.value.program]
  source_code_hash = try(filebase64sha256(local.packages[each.value.program]), null)

  code_signing_config_arn = var.code_signing_config_arn

  memory_size                    = each.value.memory_mb
  timeout                        = each.value.timeout_s
  reserved_concurrent_executions = each.value.reserved_concurrency
  kms_key_arn                    = var.kms_key_arn
  tags                           = local.tags

  ephemeral_storage {
    size = each.value.tmp_mb
  }

  environment {
    variables = merge(
      # Events name their bucket; the sweep and the failure queue's records get its name from here.
      { RAYFOLD_BUCKET = local.bucket },
      local.limits_of_animations,
      each.value.program == "render" ? local.limits_of_scripts : {},
    )
  }

  dynamic "vpc_config" {
    for_each = var.vpc == null ? [] : [var.vpc]

    content {
      subnet_ids         = vpc_config.value.subnet_ids
      security_group_ids = vpc_config.value.security_group_ids
    }
  }

  logging_config {
    log_format            = "JSON"
    application_log_level = var.log_level
    system_log_level      = "INFO"
    log_group             = aws_cloudwatch_log_group.this[each.key].name
  }

  tracing_config {
    mode = var.xray_tracing ? "Active" : "PassThrough"
  }

  lifecycle {
    precondition {
      condition     = fileexists(local.packages[each.value.program])
      error_message = "There is no ${local.packages[each.value.program]}: build it with `cargo xtask package`, or name yours in `packages`."
    }
  }

  # The first invocation must find its permissions.
  depends_on = [aws_iam_role_policy.objects, aws_iam_role_policy.platform]
}

# A function that wakes itself without end is stopped by Lambda. The longest chain here is script, part, band, claim, and one
# more claim for each further invocation that a long animation takes: one of more than a dozen is stopped, and the sweep takes
# it up again. This spells out the default, so that nobody turns it off in passing.
resource "aws_lambda_function_recursion_config" "this" {
  for_each = aws_lambda_function.this

  function_name  = each.value.function_name
  recursive_loop = "Terminate"
}

resource "aws_lambda_function_event_invoke_config" "this" {
  for_each = local.event_functions

  function_name                = aws_lambda_function.this[each.key].function_name
  maximum_retry_attempts       = var.event_retries
  maximum_event_age_in_seconds = var.event_max_age_s

  destination_config {
    on_failure {
      destination = aws_sqs_queue.failures.arn
    }
  }
}

resource "aws_lambda_permission" "bucket" {
  for_each = local.event_functions

  statement_id   = "EventsOfTheBucket"
  action         = "lambda:InvokeFunction"
  function_name  = aws_lambda_function.this[each.key].function_name
  principal      = "s3.amazonaws.com"
  source_arn     = local.bucket_arn
  source_account = local.account_id
}

resource "aws_s3_bucket_notification" "this" {
  # Not local.bucket, which checkov does not follow.
  bucket      = one(concat(aws_s3_bucket.this[*].bucket, var.existing_bucket[*]))
  eventbridge = var.eventbridge_enabled

  dynamic "lambda_function" {
    for_each = local.routes

    content {
      id                  = "${trimsuffix(lambda_function.value.prefix, "/")}-to-${lambda_function.value.function}"
      lambda_function_arn = aws_lambda_function.this[lambda_function.value.function].arn
      events              = lambda_function.value.events
      filter_prefix       = lambda_function.value.prefix
    }
  }

  dynamic "topic" {
    for_each = var.finished_topic_arn == null ? [] : [var.finished_topic_arn]

    content {
      id            = "finished"
      topic_arn     = topic.value
      events        = ["s3:ObjectCreated:*"]
      filter_prefix = "animations/"
    }
  }

  # S3 asks at once whether it may invoke; and no event may come before failures have somewhere to go.
  depends_on = [
    aws_lambda_permission.bucket,
    aws_lambda_function_event_invoke_config.this,
    aws_lambda_event_source_mapping.failures,
  ]
}
