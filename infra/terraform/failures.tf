# Where events go that a function could not handle: first to the failure queue, from which the record function writes what
# failed into the manifest; what even that cannot handle is kept for people, and sets off an alarm.

locals {
  # SQS's longest.
  retention_s = 14 * 24 * 60 * 60

  # Six times the reader's timeout, as Lambda asks: a batch that is still worked on must not be handed out again.
  visibility_s = 6 * var.record.timeout_s
}

resource "aws_sqs_queue" "dead_letters" {
  name                              = "${var.name}-dead-letters"
  message_retention_seconds         = local.retention_s
  sqs_managed_sse_enabled           = var.kms_key_arn == null ? true : null
  kms_master_key_id                 = var.kms_key_arn
  kms_data_key_reuse_period_seconds = var.kms_key_arn == null ? null : 3600
  tags                              = local.tags
}

resource "aws_sqs_queue" "failures" {
  name                              = "${var.name}-failures"
  message_retention_seconds         = local.retention_s
  visibility_timeout_seconds        = local.visibility_s
  sqs_managed_sse_enabled           = var.kms_key_arn == null ? true : null
  kms_master_key_id                 = var.kms_key_arn
  kms_data_key_reuse_period_seconds = var.kms_key_arn == null ? null : 3600
  tags                              = local.tags

  redrive_policy = jsonencode({
    deadLetterTargetArn = aws_sqs_queue.dead_letters.arn
    maxReceiveCount     = 5
  })
}

resource "aws_sqs_queue_redrive_allow_policy" "dead_letters" {
  queue_url = aws_sqs_queue.dead_letters.url

  redrive_allow_policy = jsonencode({
    redrivePermission = "byQueue"
    sourceQueueArns   = [aws_sqs_queue.failures.arn]
  })
}

resource "aws_sqs_queue_policy" "tls_only" {
  for_each = {
    failures     = aws_sqs_queue.failures
    dead_letters = aws_sqs_queue.dead_letters
  }

  queue_url = each.value.url

  policy = jsonencode({
    Version = "2012-10-17"
    Statement = [{
      Sid       = "TlsOnly"
      Effect    = "Deny"
      Principal = "*"
      Action    = "sqs:*"
      Resource  = each.value.arn
      Condition = { Bool = { "aws:SecureTransport" = "false" } }
    }]
  })
}

resource "aws_lambda_event_source_mapping" "failures" {
  event_source_arn        = aws_sqs_queue.failures.arn
  function_name           = aws_lambda_function.this["record"].arn
  batch_size              = 10
  function_response_types = ["ReportBatchItemFailures"]
  tags                    = local.tags

  # A thousand failures at once must not take all invocations from the frames.
  scaling_config {
    maximum_concurrency = 2
  }

  # Lambda asks at once whether the function may read the queue.
  depends_on = [aws_iam_role_policy.platform]
}
