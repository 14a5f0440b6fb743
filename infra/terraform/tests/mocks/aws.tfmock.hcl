# What AWS would answer: one account, one region, and ARNs that say what they belong to, as policies are compared whole.

mock_data "aws_caller_identity" {
  defaults = { account_id = "123456789012" }
}

mock_data "aws_partition" {
  defaults = { partition = "aws", dns_suffix = "amazonaws.com" }
}

mock_data "aws_region" {
  defaults = { region = "eu-central-1" }
}

override_resource {
  target = aws_s3_bucket.this[0]
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
  target = aws_lambda_function.this["record"]
  values = { arn = "arn:aws:lambda:eu-central-1:123456789012:function:demo-record" }
}

override_resource {
  target = aws_iam_role.function["render"]
  values = {
    id  = "demo-eu-central-1-render"
    arn = "arn:aws:iam::123456789012:role/demo-eu-central-1-render"
  }
}

override_resource {
  target = aws_iam_role.function["assemble"]
  values = {
    id  = "demo-eu-central-1-assemble"
    arn = "arn:aws:iam::123456789012:role/demo-eu-central-1-assemble"
  }
}

override_resource {
  target = aws_iam_role.function["record"]
  values = {
    id  = "demo-eu-central-1-record"
    arn = "arn:aws:iam::123456789012:role/demo-eu-central-1-record"
  }
}

override_resource {
  target = aws_iam_role.scheduler
  values = {
    id  = "demo-eu-central-1-sweep-schedule"
    arn = "arn:aws:iam::123456789012:role/demo-eu-central-1-sweep-schedule"
  }
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
  target = aws_s3_bucket.site[0]
  values = { arn = "arn:aws:s3:::demo-site-123456789012-eu-central-1" }
}

override_resource {
  target = aws_cloudfront_distribution.site[0]
  values = {
    arn         = "arn:aws:cloudfront::123456789012:distribution/EDFDVBD6EXAMPLE"
    domain_name = "d111111abcdef8.cloudfront.net"
  }
}

override_resource {
  target = aws_cloudfront_response_headers_policy.site[0]
  values = { id = "headers" }
}

override_resource {
  target = aws_cloudfront_cache_policy.site[0]
  values = { id = "cache" }
}

override_resource {
  target = aws_cloudfront_origin_access_control.site[0]
  values = { id = "access" }
}

override_resource {
  target = aws_iam_role.person[0]
  values = {
    id  = "demo-eu-central-1-person"
    arn = "arn:aws:iam::123456789012:role/demo-eu-central-1-person"
  }
}
