# The roles' documents, whole: whatever is added to one has to be added here too.

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

run "roles" {
  assert {
    condition = alltrue([for key, role in aws_iam_role.function : alltrue([
      role.name == "demo-${key}",
      role.permissions_boundary == null,
      jsondecode(role.assume_role_policy) == jsondecode(jsonencode({
        Version = "2012-10-17"
        Statement = [{
          Effect    = "Allow"
          Principal = { Service = "lambda.amazonaws.com" }
          Action    = "sts:AssumeRole"
        }]
      })),
    ])])
    error_message = "only Lambda may take the functions' roles"
  }
  assert {
    condition = jsondecode(aws_iam_role.scheduler.assume_role_policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [{
        Effect    = "Allow"
        Principal = { Service = "scheduler.amazonaws.com" }
        Action    = "sts:AssumeRole"
        Condition = {
          StringEquals = {
            "aws:SourceAccount" = "123456789012"
            "aws:SourceArn"     = "arn:aws:scheduler:eu-central-1:123456789012:schedule-group/demo"
          }
        }
      }]
    }))
    error_message = "only this stack's schedules may take the schedule's role"
  }
  assert {
    condition = (
      { for key, policy in aws_iam_role_policy.objects : key => policy.role } == { render = "demo-render", assemble = "demo-assemble" } &&
      { for key, policy in aws_iam_role_policy.platform : key => policy.role } == { render = "demo-render", assemble = "demo-assemble" } &&
      aws_iam_role_policy.scheduler.role == "demo-sweep-schedule"
    )
    error_message = "each document must belong to its own role"
  }
}

run "objects" {
  assert {
    condition = alltrue([for key, policy in aws_iam_role_policy.objects : jsondecode(policy.policy) == jsondecode(
      replace(file("policies/${key}.json.tftpl"), "$${bucket_arn}", "arn:aws:s3:::demo-123456789012-eu-central-1")
    )])
    error_message = "a role must have the document that the end-to-end tests enforce"
  }
  assert {
    condition = alltrue(flatten([for policy in aws_iam_role_policy.objects : [
      for statement in jsondecode(policy.policy).Statement : [
        for resource in flatten([statement.Resource]) : startswith(resource, "arn:aws:s3:::demo-123456789012-eu-central-1")
      ]
    ]]))
    error_message = "no document may name anything outside of the bucket"
  }
  assert {
    condition = alltrue(flatten([for policy in aws_iam_role_policy.objects : [
      for statement in jsondecode(policy.policy).Statement : [
        for action in flatten([statement.Action]) : statement.Effect == "Allow" && !strcontains(action, "*")
      ]
    ]]))
    error_message = "actions must be named one by one"
  }
  assert {
    condition = {
      for key, policy in aws_iam_role_policy.objects : key => join(" ", sort(distinct(flatten([
        for statement in jsondecode(policy.policy).Statement : statement.Action
      ]))))
      } == {
      render   = "s3:GetObject s3:ListBucket s3:PutObject"
      assemble = "s3:AbortMultipartUpload s3:DeleteObject s3:GetObject s3:ListBucket s3:PutObject"
    }
    error_message = "the functions need these actions; render never deletes, and neither touches old versions or settings"
  }
  assert {
    condition = {
      for key, policy in aws_iam_role_policy.objects : key => join(" ", sort([
        for resource in flatten([
          for statement in jsondecode(policy.policy).Statement : statement.Resource if statement.Action == "s3:PutObject"
        ]) : trimprefix(resource, "arn:aws:s3:::demo-123456789012-eu-central-1/")
      ]))
      } == {
      render   = "assemblies/* frames/* manifests/* parts/*"
      assemble = "animations/* assemblies/* frames/*.error.json frames/*/@assembler.json manifests/* retries/*"
    }
    error_message = "nobody writes scripts, and only assemble writes GIFs"
  }
}

run "platform" {
  assert {
    condition = jsondecode(aws_iam_role_policy.platform["render"].policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [
        {
          Sid      = "WriteOwnLog"
          Effect   = "Allow"
          Action   = ["logs:CreateLogStream", "logs:PutLogEvents"]
          Resource = "arn:aws:logs:eu-central-1:123456789012:log-group:/aws/lambda/demo-render:*"
        },
        {
          Sid      = "SendTraces"
          Effect   = "Allow"
          Action   = ["xray:PutTelemetryRecords", "xray:PutTraceSegments"]
          Resource = "*"
        },
        {
          Sid      = "HandOverFailedEvents"
          Effect   = "Allow"
          Action   = ["sqs:SendMessage"]
          Resource = "arn:aws:sqs:eu-central-1:123456789012:demo-failures"
        },
      ]
    }))
    error_message = "render: its own log, traces, and the failure queue to write to"
  }
  assert {
    condition = jsondecode(aws_iam_role_policy.platform["assemble"].policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [
        {
          Sid      = "WriteOwnLog"
          Effect   = "Allow"
          Action   = ["logs:CreateLogStream", "logs:PutLogEvents"]
          Resource = "arn:aws:logs:eu-central-1:123456789012:log-group:/aws/lambda/demo-assemble:*"
        },
        {
          Sid      = "SendTraces"
          Effect   = "Allow"
          Action   = ["xray:PutTelemetryRecords", "xray:PutTraceSegments"]
          Resource = "*"
        },
        {
          Sid      = "HandOverAndReadFailedEvents"
          Effect   = "Allow"
          Action   = ["sqs:DeleteMessage", "sqs:GetQueueAttributes", "sqs:ReceiveMessage", "sqs:SendMessage"]
          Resource = "arn:aws:sqs:eu-central-1:123456789012:demo-failures"
        },
      ]
    }))
    error_message = "assemble: its own log, traces, and the failure queue to write to and to read"
  }
  assert {
    condition = jsondecode(aws_iam_role_policy.scheduler.policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [
        {
          Sid      = "WakeTheAssembleFunction"
          Effect   = "Allow"
          Action   = ["lambda:InvokeFunction"]
          Resource = "arn:aws:lambda:eu-central-1:123456789012:function:demo-assemble"
        },
        {
          Sid      = "KeepWhatCouldNotBeDelivered"
          Effect   = "Allow"
          Action   = ["sqs:SendMessage"]
          Resource = "arn:aws:sqs:eu-central-1:123456789012:demo-dead-letters"
        },
      ]
    }))
    error_message = "the schedule: one function to wake, one queue for what could not be delivered"
  }
}

run "with_a_key" {
  variables {
    customer_managed_key = true
  }

  assert {
    condition = alltrue([for policy in aws_iam_role_policy.platform : jsondecode(policy.policy).Statement[3] == jsondecode(jsonencode({
      Sid      = "UseTheKeyThroughBucketAndQueue"
      Effect   = "Allow"
      Action   = ["kms:Decrypt", "kms:GenerateDataKey"]
      Resource = "arn:aws:kms:eu-central-1:123456789012:key/11111111-2222-3333-4444-555555555555"
      Condition = {
        StringEquals = { "kms:ViaService" = ["s3.eu-central-1.amazonaws.com", "sqs.eu-central-1.amazonaws.com"] }
      }
    })) && length(jsondecode(policy.policy).Statement) == 4])
    error_message = "the functions may use the key for the bucket's objects and the failure queue, and for nothing else"
  }
  assert {
    condition = jsondecode(aws_iam_role_policy.scheduler.policy).Statement[2] == jsondecode(jsonencode({
      Sid       = "UseTheKeyThroughTheQueue"
      Effect    = "Allow"
      Action    = ["kms:Decrypt", "kms:GenerateDataKey"]
      Resource  = "arn:aws:kms:eu-central-1:123456789012:key/11111111-2222-3333-4444-555555555555"
      Condition = { StringEquals = { "kms:ViaService" = ["sqs.eu-central-1.amazonaws.com"] } }
    }))
    error_message = "the schedule may use the key for the dead-letter queue"
  }
  assert {
    condition = jsondecode(one(aws_kms_key.this[*].policy)) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [
        {
          Sid       = "AccountAdministersByIam"
          Effect    = "Allow"
          Principal = { AWS = "arn:aws:iam::123456789012:root" }
          Action    = "kms:*"
          Resource  = "*"
        },
        {
          Sid       = "LogGroupsOfTheFunctions"
          Effect    = "Allow"
          Principal = { Service = "logs.eu-central-1.amazonaws.com" }
          Action    = ["kms:Decrypt", "kms:DescribeKey", "kms:Encrypt", "kms:GenerateDataKey*", "kms:ReEncrypt*"]
          Resource  = "*"
          Condition = {
            ArnEquals = {
              "kms:EncryptionContext:aws:logs:arn" = [
                "arn:aws:logs:eu-central-1:123456789012:log-group:/aws/lambda/demo-assemble",
                "arn:aws:logs:eu-central-1:123456789012:log-group:/aws/lambda/demo-render",
              ]
            }
          }
        },
      ]
    }))
    error_message = "the key: the account by its IAM policies, and the log service for these two groups"
  }
}
