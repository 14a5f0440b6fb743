# A stack as a team would run it: a key from examples/key, an access log, alarms and a budget that reach somebody, rights for people.
# Build packages and page first: cargo xtask package --architecture arm64, cargo xtask site

provider "aws" {
  region = var.region

  default_tags {
    tags = { Team = "film", ManagedBy = "terraform" }
  }
}

data "aws_caller_identity" "current" {}

data "aws_partition" "current" {}

locals {
  account_id = data.aws_caller_identity.current.account_id
  partition  = data.aws_partition.current.partition
}

module "rayfold" {
  source = "../.."

  name = var.name
  tags = { CostCenter = "4711" }

  # Objects
  noncurrent_version_days = 14
  kms_key_arn             = var.kms_key_arn
  access_log_bucket       = aws_s3_bucket.access_log.bucket
  access_log_prefix       = "${var.name}/"

  # Functions: Graviton is cheaper, two vCPUs a frame are twice as fast at the same price
  architecture = "arm64"
  packages     = var.packages
  render = {
    memory_mb            = 3538
    timeout_s            = 600
    reserved_concurrency = var.render_concurrency
  }
  assemble = {
    memory_mb = 5307
  }
  limits = {
    max_frames = 1000
    max_pixels = 8294400 # 3840 x 2160
  }

  # Events and watching
  sweep_minutes      = 10
  log_retention_days = 90
  alarm_actions      = [aws_sns_topic.alarms.arn]
  alarm_thresholds   = { event_age_s = 900 }
  budget = {
    monthly_usd = 50
    topic_arns  = [aws_sns_topic.alarms.arn]
  }

  # The studio's page, without sign-in: examples/people has that
  site        = true
  site_folder = var.site_folder

  depends_on = [aws_s3_bucket_policy.access_log]
}

# What people may do. Attach them to groups, or to permission sets.

resource "aws_iam_policy" "user" {
  for_each = toset(["viewer", "uploader", "operator"])

  name        = "${var.name}-${var.region}-${each.key}"
  description = "What ${each.key}s of ${var.name} may do with its bucket"
  policy      = module.rayfold.user_policies[each.key]
}

# The recipients of messages. Subscribe by `aws sns subscribe --protocol email --topic-arn ... --notification-endpoint you@example.com`.

resource "aws_sns_topic" "alarms" {
  name              = "${var.name}-alarms"
  kms_master_key_id = aws_kms_key.alarms.arn
}

# Alarms cannot use the key that AWS manages for SNS: its policy lets no other service in.
resource "aws_kms_key" "alarms" {
  description         = "${var.name}: alarms"
  enable_key_rotation = true

  policy = jsonencode({
    Version = "2012-10-17"
    Statement = [
      {
        Sid       = "AccountAdministersByIam"
        Effect    = "Allow"
        Principal = { AWS = "arn:${local.partition}:iam::${local.account_id}:root" }
        Action    = "kms:*"
        Resource  = "*"
      },
      {
        Sid       = "AlarmsAndBudgetsOfThisAccount"
        Effect    = "Allow"
        Principal = { Service = ["budgets.amazonaws.com", "cloudwatch.amazonaws.com"] }
        Action    = ["kms:Decrypt", "kms:GenerateDataKey*"]
        Resource  = "*"
        Condition = { StringEquals = { "aws:SourceAccount" = local.account_id } }
      },
    ]
  })
}

resource "aws_sns_topic_policy" "alarms" {
  arn = aws_sns_topic.alarms.arn

  policy = jsonencode({
    Version = "2012-10-17"
    Statement = [{
      Sid       = "AlarmsAndBudgetsOfThisAccount"
      Effect    = "Allow"
      Principal = { Service = ["budgets.amazonaws.com", "cloudwatch.amazonaws.com"] }
      Action    = "sns:Publish"
      Resource  = aws_sns_topic.alarms.arn
      Condition = { StringEquals = { "aws:SourceAccount" = local.account_id } }
    }]
  })
}

# Where the access log goes. A team has one for all of its buckets.

resource "aws_s3_bucket" "access_log" {
  #checkov:skip=CKV_AWS_18:A log of the log would log itself
  #checkov:skip=CKV_AWS_21:A log is only ever added to
  #checkov:skip=CKV_AWS_144:The log is for looking back some weeks, and not worth a copy
  #checkov:skip=CKV_AWS_145:The log service writes to buckets with S3's own keys only
  #checkov:skip=CKV2_AWS_62:Nobody waits for log lines
  bucket = "${var.name}-access-log-${local.account_id}-${var.region}"
}

resource "aws_s3_bucket_ownership_controls" "access_log" {
  bucket = aws_s3_bucket.access_log.bucket

  rule {
    object_ownership = "BucketOwnerEnforced"
  }
}

resource "aws_s3_bucket_public_access_block" "access_log" {
  bucket                  = aws_s3_bucket.access_log.bucket
  block_public_acls       = true
  block_public_policy     = true
  ignore_public_acls      = true
  restrict_public_buckets = true
}

resource "aws_s3_bucket_server_side_encryption_configuration" "access_log" {
  bucket = aws_s3_bucket.access_log.bucket

  rule {
    apply_server_side_encryption_by_default {
      sse_algorithm = "AES256"
    }
  }
}

resource "aws_s3_bucket_lifecycle_configuration" "access_log" {
  bucket = aws_s3_bucket.access_log.bucket

  rule {
    id     = "forget"
    status = "Enabled"

    filter {}

    expiration {
      days = 90
    }

    abort_incomplete_multipart_upload {
      days_after_initiation = 1
    }
  }
}

resource "aws_s3_bucket_policy" "access_log" {
  bucket = aws_s3_bucket.access_log.bucket

  policy = jsonencode({
    Version = "2012-10-17"
    Statement = [
      {
        Sid       = "TlsOnly"
        Effect    = "Deny"
        Principal = "*"
        Action    = "s3:*"
        Resource  = [aws_s3_bucket.access_log.arn, "${aws_s3_bucket.access_log.arn}/*"]
        Condition = { Bool = { "aws:SecureTransport" = "false" } }
      },
      {
        Sid       = "LogsOfThisAccount"
        Effect    = "Allow"
        Principal = { Service = "logging.s3.amazonaws.com" }
        Action    = "s3:PutObject"
        Resource  = "${aws_s3_bucket.access_log.arn}/${var.name}/*"
        Condition = { StringEquals = { "aws:SourceAccount" = local.account_id } }
      },
    ]
  })

  depends_on = [aws_s3_bucket_public_access_block.access_log]
}
