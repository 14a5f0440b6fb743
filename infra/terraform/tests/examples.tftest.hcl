# The examples, applied as they stand.

mock_provider "aws" {
  mock_data "aws_caller_identity" {
    defaults = { account_id = "123456789012" }
  }

  mock_data "aws_partition" {
    defaults = { partition = "aws", dns_suffix = "amazonaws.com" }
  }

  mock_data "aws_region" {
    defaults = { region = "us-east-1" }
  }

  mock_resource "aws_sns_topic" {
    defaults = { arn = "arn:aws:sns:us-east-1:123456789012:rayfold-alarms" }
  }

  mock_resource "aws_s3_bucket" {
    defaults = { arn = "arn:aws:s3:::bucket" }
  }
}

variables {
  packages = {
    render   = "tests/packages/rayfold-render.zip"
    assemble = "tests/packages/rayfold-assemble.zip"
  }
}

run "minimal" {
  module {
    source = "./examples/minimal"
  }

  assert {
    condition     = output.sync_command == "aws s3 sync FOLDER s3://rayfold-123456789012-us-east-1/scripts/FOLDER/ --region us-east-1"
    error_message = output.sync_command
  }
  assert {
    condition     = output.submit_command == "AWS_REGION=us-east-1 rayfold submit FOLDER --bucket rayfold-123456789012-us-east-1"
    error_message = output.submit_command
  }
}

run "minimal_elsewhere" {
  variables {
    name = "film"
  }

  module {
    source = "./examples/minimal"
  }

  assert {
    condition     = output.sync_command == "aws s3 sync FOLDER s3://film-123456789012-us-east-1/scripts/FOLDER/ --region us-east-1"
    error_message = output.sync_command
  }
}

run "complete" {
  variables {
    site_folder = "tests/site"
    kms_key_arn = "arn:aws:kms:us-east-1:123456789012:key/11111111-2222-3333-4444-555555555555"
  }

  module {
    source = "./examples/complete"
  }

  assert {
    condition     = output.bucket == "rayfold-123456789012-us-east-1"
    error_message = output.bucket
  }
  assert {
    condition     = output.alarm_topic_arn == "arn:aws:sns:us-east-1:123456789012:rayfold-alarms"
    error_message = output.alarm_topic_arn
  }
  assert {
    condition     = endswith(output.dashboard_url, "#dashboards/dashboard/rayfold-us-east-1")
    error_message = output.dashboard_url
  }
  assert {
    condition     = startswith(output.site_url, "https://")
    error_message = output.site_url
  }
  assert {
    condition     = keys(output.user_policy_arns) == ["operator", "uploader", "viewer"]
    error_message = "there must be a policy for each kind of user"
  }
  assert {
    condition     = strcontains(aws_iam_policy.user["viewer"].policy, var.kms_key_arn)
    error_message = "people must be able to use the key"
  }
  assert {
    condition     = aws_s3_bucket.access_log.bucket == "rayfold-access-log-123456789012-us-east-1"
    error_message = aws_s3_bucket.access_log.bucket
  }
  assert {
    condition = alltrue([
      aws_s3_bucket_public_access_block.access_log.block_public_acls,
      aws_s3_bucket_public_access_block.access_log.block_public_policy,
      aws_s3_bucket_public_access_block.access_log.ignore_public_acls,
      aws_s3_bucket_public_access_block.access_log.restrict_public_buckets,
    ])
    error_message = "the log may not be public either"
  }
  assert {
    condition = [
      for statement in jsondecode(aws_s3_bucket_policy.access_log.policy).Statement : statement.Principal if statement.Effect == "Allow"
    ] == [{ Service = "logging.s3.amazonaws.com" }]
    error_message = "only S3's log service may write into the log"
  }
  assert {
    condition     = jsondecode(aws_sns_topic_policy.alarms.policy).Statement[0].Principal == { Service = ["budgets.amazonaws.com", "cloudwatch.amazonaws.com"] }
    error_message = "only alarms and budgets may publish"
  }
}

run "key" {
  # It is not to be destroyed, which a test that applies would have to do in the end.
  command = plan

  module {
    source = "./examples/key"
  }

  assert {
    condition     = aws_kms_key.objects.enable_key_rotation && aws_kms_key.objects.deletion_window_in_days == 30 && aws_kms_alias.objects.name == "alias/rayfold"
    error_message = "the key must rotate, be slow to go, and be found by name"
  }
  assert {
    condition = jsondecode(aws_kms_key.objects.policy) == jsondecode(jsonencode({
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
          Principal = { Service = "logs.us-east-1.amazonaws.com" }
          Action    = ["kms:Decrypt", "kms:DescribeKey", "kms:Encrypt", "kms:GenerateDataKey*", "kms:ReEncrypt*"]
          Resource  = "*"
          Condition = {
            ArnLike = {
              "kms:EncryptionContext:aws:logs:arn" = "arn:aws:logs:us-east-1:123456789012:log-group:/aws/lambda/rayfold-*"
            }
          }
        },
      ]
    }))
    error_message = "the key: the account by its IAM policies, and the log service for the stack's groups"
  }
}
