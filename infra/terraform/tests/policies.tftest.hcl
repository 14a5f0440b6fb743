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
      role.name == "demo-eu-central-1-${key}",
      role.path == "/",
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
      { for key, policy in aws_iam_role_policy.objects : key => policy.role } == { for key in ["render", "assemble", "record"] : key => "demo-eu-central-1-${key}" } &&
      { for key, policy in aws_iam_role_policy.platform : key => policy.role } == { for key in ["render", "assemble", "record"] : key => "demo-eu-central-1-${key}" } &&
      aws_iam_role_policy.scheduler.role == "demo-eu-central-1-sweep-schedule"
    )
    error_message = "each document must belong to its own role"
  }
}

run "objects" {
  assert {
    condition = alltrue([for key, policy in aws_iam_role_policy.objects : jsondecode(policy.policy) == jsondecode(
      replace(file("policies/${key == "record" ? "assemble" : key}.json.tftpl"), "$${bucket_arn}", "arn:aws:s3:::demo-123456789012-eu-central-1")
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
      record   = "s3:AbortMultipartUpload s3:DeleteObject s3:GetObject s3:ListBucket s3:PutObject"
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
      render   = "assemblies/* frames/*.band frames/*.begun-* frames/*.cut-* frames/*.error.json frames/*.files-* frames/*.png frames/*.split-* frames/*.taken frames/*.waits.json manifests/* parts/*"
      assemble = "animations/* assemblies/* checkpoints/* frames/*.error.json frames/*/@assembler.json frames/*/@output.* frames/*/@sweep.json manifests/* retries/*"
      record   = "animations/* assemblies/* checkpoints/* frames/*.error.json frames/*/@assembler.json frames/*/@output.* frames/*/@sweep.json manifests/* retries/*"
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
          Sid      = "HandOverFailedEvents"
          Effect   = "Allow"
          Action   = ["sqs:SendMessage"]
          Resource = "arn:aws:sqs:eu-central-1:123456789012:demo-failures"
        },
      ]
    }))
    error_message = "assemble: its own log, traces, and the failure queue to write to"
  }
  assert {
    condition = jsondecode(aws_iam_role_policy.platform["record"].policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [
        {
          Sid      = "WriteOwnLog"
          Effect   = "Allow"
          Action   = ["logs:CreateLogStream", "logs:PutLogEvents"]
          Resource = "arn:aws:logs:eu-central-1:123456789012:log-group:/aws/lambda/demo-record:*"
        },
        {
          Sid      = "SendTraces"
          Effect   = "Allow"
          Action   = ["xray:PutTelemetryRecords", "xray:PutTraceSegments"]
          Resource = "*"
        },
        {
          Sid      = "ReadFailedEvents"
          Effect   = "Allow"
          Action   = ["sqs:DeleteMessage", "sqs:GetQueueAttributes", "sqs:ReceiveMessage"]
          Resource = "arn:aws:sqs:eu-central-1:123456789012:demo-failures"
        },
      ]
    }))
    error_message = "record: its own log, traces, and the failure queue to read"
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
    kms_key_arn         = "arn:aws:kms:eu-central-1:123456789012:key/11111111-2222-3333-4444-555555555555"
    former_kms_key_arns = ["arn:aws:kms:eu-central-1:123456789012:key/99999999-2222-3333-4444-555555555555"]
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
    })) && length(jsondecode(policy.policy).Statement) == 5])
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
    condition = alltrue(flatten([
      for services, policies in {
        "s3 sqs" = values(aws_iam_role_policy.platform)[*].policy
        "s3"     = values(output.user_policies)
        } : [for policy in policies : anytrue([
          for statement in jsondecode(policy).Statement : jsonencode(statement) == jsonencode({
            Sid       = "ReadWhatItEncrypted0"
            Effect    = "Allow"
            Action    = ["kms:Decrypt"]
            Resource  = "arn:aws:kms:eu-central-1:123456789012:key/99999999-2222-3333-4444-555555555555"
            Condition = { StringEquals = { "kms:ViaService" = [for service in split(" ", services) : "${service}.eu-central-1.amazonaws.com"] } }
          })
      ])]
    ]))
    error_message = "what a former key encrypted must stay readable: objects for functions and people, failure messages for the functions"
  }
  assert {
    condition = {
      for user, policy in output.user_policies : user => [
        for statement in jsondecode(policy).Statement : join(" ", statement.Action) if statement.Sid == "UseTheKeyThroughTheBucket"
      ]
      } == {
      viewer   = ["kms:Decrypt"]
      uploader = ["kms:Decrypt kms:GenerateDataKey"]
      operator = ["kms:Decrypt kms:GenerateDataKey"]
    }
    error_message = "who uploads needs the key to encrypt, who looks to decrypt"
  }
}

run "in_another_partition" {
  variables {
    kms_key_arn = "arn:aws-cn:kms:cn-north-1:123456789012:key/11111111-2222-3333-4444-555555555555"
  }

  override_data {
    target = data.aws_partition.current
    values = { partition = "aws-cn", dns_suffix = "amazonaws.com.cn" }
  }

  override_data {
    target = data.aws_region.current
    values = { region = "cn-north-1" }
  }

  assert {
    condition = alltrue(flatten([for policy in aws_iam_role_policy.platform : [
      for statement in jsondecode(policy.policy).Statement :
      statement.Condition.StringEquals["kms:ViaService"] == ["s3.cn-north-1.amazonaws.com.cn", "sqs.cn-north-1.amazonaws.com.cn"]
      if statement.Sid == "UseTheKeyThroughBucketAndQueue"
    ]]))
    error_message = "the key must be reached by the partition's own service names"
  }
  assert {
    condition     = startswith(output.dashboard_url, "https://cn-north-1.console.amazonaws.cn/cloudwatch/home?region=cn-north-1#")
    error_message = output.dashboard_url
  }
}

run "people" {
  assert {
    condition = alltrue([for user in ["viewer", "uploader", "operator"] : jsondecode(output.user_policies[user]) == jsondecode(
      replace(file("policies/${user}.json.tftpl"), "$${bucket_arn}", "arn:aws:s3:::demo-123456789012-eu-central-1")
    )]) && length(output.user_policies) == 3
    error_message = "people must get the documents that the tests of the commands enforce"
  }
  assert {
    condition = alltrue(flatten([for policy in output.user_policies : [
      for statement in jsondecode(policy).Statement : [
        for action in flatten([statement.Action]) : statement.Effect == "Allow" && !strcontains(action, "*")
      ]
    ]]))
    error_message = "actions must be named one by one"
  }
}
