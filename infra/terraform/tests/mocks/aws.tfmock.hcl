# What AWS would answer: one account, one region, and ARNs that say what they belong to, as policies are compared whole.

mock_data "aws_caller_identity" {
  defaults = { account_id = "123456789012" }
}

mock_data "aws_partition" {
  defaults = { partition = "aws" }
}

mock_data "aws_region" {
  defaults = { region = "eu-central-1" }
}

override_resource {
  target = aws_s3_bucket.this
  values = { arn = "arn:aws:s3:::demo-123456789012-eu-central-1" }
}

override_resource {
  target = aws_lambda_function.this["render"]
  values = { arn = "arn:aws:lambda:eu-central-1:123456789012:function:demo-render" }
}

override_resource {
  target = aws_lambda_function.this["assemble"]
  values = { arn = "arn:aws:lambda:eu-central-1:123456789012:function:demo-assemble" }
}

override_resource {
  target = aws_iam_role.function["render"]
  values = { id = "demo-render", arn = "arn:aws:iam::123456789012:role/demo-render" }
}

override_resource {
  target = aws_iam_role.function["assemble"]
  values = { id = "demo-assemble", arn = "arn:aws:iam::123456789012:role/demo-assemble" }
}

override_resource {
  target = aws_iam_role.scheduler
  values = { id = "demo-sweep-schedule", arn = "arn:aws:iam::123456789012:role/demo-sweep-schedule" }
}

override_resource {
  target = aws_sqs_queue.failures
  values = {
    arn = "arn:aws:sqs:eu-central-1:123456789012:demo-failures"
    url = "https://sqs.eu-central-1.amazonaws.com/123456789012/demo-failures"
  }
}

override_resource {
  target = aws_sqs_queue.dead_letters
  values = {
    arn = "arn:aws:sqs:eu-central-1:123456789012:demo-dead-letters"
    url = "https://sqs.eu-central-1.amazonaws.com/123456789012/demo-dead-letters"
  }
}

override_resource {
  target = aws_scheduler_schedule_group.this
  values = { arn = "arn:aws:scheduler:eu-central-1:123456789012:schedule-group/demo" }
}

override_resource {
  target = aws_kms_key.this[0]
  values = {
    key_id = "11111111-2222-3333-4444-555555555555"
    arn    = "arn:aws:kms:eu-central-1:123456789012:key/11111111-2222-3333-4444-555555555555"
  }
}
