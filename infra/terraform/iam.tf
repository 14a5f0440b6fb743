# Who may do what. Each function has a role of its own with two policies: `objects`, the document in policies/ that the
# end-to-end tests enforce on the same binaries, and `platform`, for what surrounds them in AWS. What people need is an
# output, for the stack knows none of them.

resource "aws_iam_role" "function" {
  for_each = local.functions

  name                 = "${local.global_name}-${each.key}"
  path                 = var.role_path
  description          = "What the ${each.key} function of ${var.name} may do"
  permissions_boundary = var.permissions_boundary_arn
  tags                 = local.tags

  assume_role_policy = jsonencode({
    Version = "2012-10-17"
    Statement = [{
      Effect    = "Allow"
      Principal = { Service = "lambda.amazonaws.com" }
      Action    = "sts:AssumeRole"
    }]
  })
}

resource "aws_iam_role_policy" "objects" {
  for_each = local.functions

  name = "objects"
  role = aws_iam_role.function[each.key].id

  # Through jsondecode, so that a template that is no JSON fails the plan.
  policy = jsonencode(jsondecode(templatefile("${path.module}/policies/${each.value.program}.json.tftpl", {
    bucket_arn = local.bucket_arn
  })))
}

locals {
  # The role's own log group only, which the stack creates: a function never does.
  log_statements = {
    for function, arn in local.log_group_arns : function => [{
      Sid      = "WriteOwnLog"
      Effect   = "Allow"
      Action   = ["logs:CreateLogStream", "logs:PutLogEvents"]
      Resource = "${arn}:*"
    }]
  }

  # X-Ray knows no resources: these two actions are granted on everything or not at all.
  trace_statements = var.xray_tracing ? [{
    Sid      = "SendTraces"
    Effect   = "Allow"
    Action   = ["xray:PutTelemetryRecords", "xray:PutTraceSegments"]
    Resource = "*"
  }] : []

  failure_statements = {
    render = [{
      Sid      = "HandOverFailedEvents"
      Effect   = "Allow"
      Action   = ["sqs:SendMessage"]
      Resource = aws_sqs_queue.failures.arn
    }]
    assemble = [{
      Sid      = "HandOverFailedEvents"
      Effect   = "Allow"
      Action   = ["sqs:SendMessage"]
      Resource = aws_sqs_queue.failures.arn
    }]
    record = [{
      Sid      = "ReadFailedEvents"
      Effect   = "Allow"
      Action   = ["sqs:DeleteMessage", "sqs:GetQueueAttributes", "sqs:ReceiveMessage"]
      Resource = aws_sqs_queue.failures.arn
    }]
  }

  key_statements = concat([for arn in var.kms_key_arn[*] : {
    Sid       = "UseTheKeyThroughBucketAndQueue"
    Effect    = "Allow"
    Action    = ["kms:Decrypt", "kms:GenerateDataKey"]
    Resource  = arn
    Condition = { StringEquals = { "kms:ViaService" = [local.kms_s3, local.kms_sqs] } }
  }], local.former_key_statements.functions)

  # What Lambda needs to put a function into a VPC, which knows no resources; the function's own code may not use it.
  vpc_actions = [
    "ec2:AssignPrivateIpAddresses", "ec2:CreateNetworkInterface", "ec2:DeleteNetworkInterface",
    "ec2:DescribeNetworkInterfaces", "ec2:DescribeSubnets", "ec2:UnassignPrivateIpAddresses",
  ]
  vpc_statements = {
    for function, name in local.function_names : function => concat(
      [for vpc in var.vpc[*] : {
        Sid      = "BeInTheVpc"
        Effect   = "Allow"
        Action   = local.vpc_actions
        Resource = "*"
      }],
      [for vpc in var.vpc[*] : {
        Sid      = "OnlyLambdaItself"
        Effect   = "Deny"
        Action   = local.vpc_actions
        Resource = "*"
        Condition = {
          ArnEquals = {
            "lambda:SourceFunctionArn" = "arn:${local.partition}:lambda:${local.region}:${local.account_id}:function:${name}"
          }
        }
      }],
    )
  }
}

resource "aws_iam_role_policy" "platform" {
  for_each = local.functions

  name = "platform"
  role = aws_iam_role.function[each.key].id

  policy = jsonencode({
    Version = "2012-10-17"
    Statement = concat(
      local.log_statements[each.key],
      local.trace_statements,
      local.failure_statements[each.key],
      local.key_statements,
      local.vpc_statements[each.key],
    )
  })
}

resource "aws_iam_role" "scheduler" {
  name                 = "${local.global_name}-sweep-schedule"
  path                 = var.role_path
  description          = "Lets the schedule of ${var.name} wake the assemble function"
  permissions_boundary = var.permissions_boundary_arn
  tags                 = local.tags

  assume_role_policy = jsonencode({
    Version = "2012-10-17"
    Statement = [{
      Effect    = "Allow"
      Principal = { Service = "scheduler.amazonaws.com" }
      Action    = "sts:AssumeRole"
      Condition = {
        StringEquals = {
          "aws:SourceAccount" = local.account_id
          "aws:SourceArn"     = aws_scheduler_schedule_group.this.arn
        }
      }
    }]
  })
}

resource "aws_iam_role_policy" "scheduler" {
  name = "sweep"
  role = aws_iam_role.scheduler.id

  policy = jsonencode({
    Version = "2012-10-17"
    Statement = concat(
      [
        {
          Sid      = "WakeTheAssembleFunction"
          Effect   = "Allow"
          Action   = ["lambda:InvokeFunction"]
          Resource = aws_lambda_function.this["assemble"].arn
        },
        {
          Sid      = "KeepWhatCouldNotBeDelivered"
          Effect   = "Allow"
          Action   = ["sqs:SendMessage"]
          Resource = aws_sqs_queue.dead_letters.arn
        },
      ],
      [for arn in var.kms_key_arn[*] : {
        Sid       = "UseTheKeyThroughTheQueue"
        Effect    = "Allow"
        Action    = ["kms:Decrypt", "kms:GenerateDataKey"]
        Resource  = arn
        Condition = { StringEquals = { "kms:ViaService" = [local.kms_sqs] } }
      }],
    )
  })
}

locals {
  # What each kind of user may do with objects: policies/KIND.json.tftpl, which the tests of the commands enforce.
  users = {
    viewer   = ["kms:Decrypt"]
    uploader = ["kms:Decrypt", "kms:GenerateDataKey"]
    operator = ["kms:Decrypt", "kms:GenerateDataKey"]
  }

  # As an uploader, `person` encrypts and decrypts (people.tf).
  key_statements_of_people = {
    for user, key_actions in merge(local.users, { person = local.users.uploader }) : user => concat(
      [for arn in var.kms_key_arn[*] : {
        Sid       = "UseTheKeyThroughTheBucket"
        Effect    = "Allow"
        Action    = key_actions
        Resource  = arn
        Condition = { StringEquals = { "kms:ViaService" = [local.kms_s3] } }
      }],
      local.former_key_statements.people,
    )
  }

  user_policies = {
    for user in keys(local.users) : user => jsonencode({
      Version = "2012-10-17"
      Statement = concat(
        jsondecode(templatefile("${path.module}/policies/${user}.json.tftpl", {
          bucket_arn = local.bucket_arn
        })).Statement,
        local.key_statements_of_people[user],
      )
    })
  }
}
