# One bucket holds everything: what is uploaded, what is made of it, and all state in between.

locals {
  # 1 where the stack makes the bucket, 0 where it is given one (`existing_bucket`). The settings of a bucket that is given are
  # its owner's: the stack sets its notifications and nothing else.
  made_here = var.existing_bucket == null ? 1 : 0

  bucket     = one(concat(aws_s3_bucket.this[*].bucket, var.existing_bucket[*]))
  bucket_arn = one(concat(aws_s3_bucket.this[*].arn, [for name in var.existing_bucket[*] : "arn:${local.partition}:s3:::${name}"]))
}

locals {
  tls_statements = {
    for use, arn in merge(
      { for arn in aws_s3_bucket.this[*].arn : "objects" => arn },
      { for arn in aws_s3_bucket.site[*].arn : "site" => arn },
      ) : use => [
      {
        Sid       = "TlsOnly"
        Effect    = "Deny"
        Principal = "*"
        Action    = "s3:*"
        Resource  = [arn, "${arn}/*"]
        Condition = { Bool = { "aws:SecureTransport" = "false" } }
      },
      {
        Sid       = "Tls12OrNewer"
        Effect    = "Deny"
        Principal = "*"
        Action    = "s3:*"
        Resource  = [arn, "${arn}/*"]
        Condition = { NumericLessThan = { "s3:TlsVersion" = "1.2" } }
      },
    ]
  }
}

resource "aws_s3_bucket" "this" {
  count = local.made_here

  #checkov:skip=CKV_AWS_144:Frames and animations can be made again from the scripts, and their owner has those
  #checkov:skip=CKV_AWS_145:The key is optional (kms_key_arn): with it the same bytes render again
  bucket        = coalesce(var.bucket_name, "${var.name}-${local.account_id}-${local.region}")
  force_destroy = var.force_destroy
  tags          = local.tags
}

resource "aws_s3_bucket_ownership_controls" "this" {
  count = local.made_here

  bucket = aws_s3_bucket.this[0].bucket

  rule {
    object_ownership = "BucketOwnerEnforced"
  }
}

resource "aws_s3_bucket_public_access_block" "this" {
  count = local.made_here

  bucket                  = aws_s3_bucket.this[0].bucket
  block_public_acls       = true
  block_public_policy     = true
  ignore_public_acls      = true
  restrict_public_buckets = true
}

resource "aws_s3_bucket_policy" "this" {
  count = local.made_here

  bucket = aws_s3_bucket.this[0].bucket

  policy = jsonencode({
    Version   = "2012-10-17"
    Statement = concat(local.tls_statements["objects"], var.bucket_policy_statements)
  })

  # Both write the bucket's policy state; at the same time S3 answers with a conflict.
  depends_on = [aws_s3_bucket_public_access_block.this]
}

resource "aws_s3_bucket_server_side_encryption_configuration" "this" {
  count = local.made_here

  bucket = aws_s3_bucket.this[0].bucket

  rule {
    bucket_key_enabled = var.kms_key_arn != null

    apply_server_side_encryption_by_default {
      sse_algorithm     = var.kms_key_arn == null ? "AES256" : "aws:kms"
      kms_master_key_id = var.kms_key_arn
    }
  }
}

resource "aws_s3_bucket_versioning" "this" {
  count = local.made_here

  bucket = aws_s3_bucket.this[0].bucket

  versioning_configuration {
    status = "Enabled"
  }
}

locals {
  # A rule names one prefix. What people value is kept for longer than the pipeline's own objects: a manifest is
  # written once for every few frames, and each old version would be stored, and billed, for as long.
  noncurrent_days = {
    "scripts/"     = var.noncurrent_version_days
    "animations/"  = var.noncurrent_version_days
    "parts/"       = 1
    "frames/"      = 1
    "manifests/"   = 1
    "assemblies/"  = 1
    "retries/"     = 1
    "checkpoints/" = 1
  }

  # The only current objects that age removes. Every other one is a receipt: gone, its work would be done again. A
  # checkpoint is of use for as long as its upload is there, which is removed after a day.
  expiry_days = {
    "assemblies/"  = var.claim_days
    "retries/"     = var.claim_days
    "checkpoints/" = 1
  }
}

resource "aws_s3_bucket_lifecycle_configuration" "this" {
  count = local.made_here

  bucket = aws_s3_bucket.this[0].bucket

  rule {
    id     = "unfinished-uploads-and-lone-delete-markers"
    status = "Enabled"

    filter {}

    abort_incomplete_multipart_upload {
      days_after_initiation = 1
    }

    expiration {
      expired_object_delete_marker = true
    }
  }

  dynamic "rule" {
    for_each = local.noncurrent_days

    content {
      id     = "noncurrent-${trimsuffix(rule.key, "/")}"
      status = "Enabled"

      filter {
        prefix = rule.key
      }

      noncurrent_version_expiration {
        noncurrent_days = rule.value
      }
    }
  }

  dynamic "rule" {
    for_each = local.expiry_days

    content {
      id     = "spent-${trimsuffix(rule.key, "/")}"
      status = "Enabled"

      filter {
        prefix = rule.key
      }

      expiration {
        days = rule.value
      }
    }
  }

  # Rules for noncurrent versions mean nothing before the bucket has versions.
  depends_on = [aws_s3_bucket_versioning.this]
}

resource "aws_s3_bucket_logging" "this" {
  count = var.access_log_bucket == null ? 0 : local.made_here

  bucket        = aws_s3_bucket.this[0].bucket
  target_bucket = var.access_log_bucket
  target_prefix = var.access_log_prefix
}
