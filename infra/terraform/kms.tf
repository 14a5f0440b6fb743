# The caller's key, if there is one. The stack makes none, so that nothing done to the stack can destroy the key that its
# objects are encrypted with.

locals {
  # By way of which services the stack and its users may use the key.
  kms_s3  = "s3.${local.region}.${local.dns_suffix}"
  kms_sqs = "sqs.${local.region}.${local.dns_suffix}"

  # What a former key encrypted can still be read: objects of the bucket, and for the functions messages of the queues,
  # which wait for up to two weeks.
  former_key_statements = {
    for reader, services in { functions = [local.kms_s3, local.kms_sqs], people = [local.kms_s3] } :
    reader => [for arn in var.former_kms_key_arns : {
      Sid       = "ReadWhatItEncrypted${index(var.former_kms_key_arns, arn)}"
      Effect    = "Allow"
      Action    = ["kms:Decrypt"]
      Resource  = arn
      Condition = { StringEquals = { "kms:ViaService" = services } }
    }]
  }
}

# Up to version 0.1.0 the stack made the key itself. An upgrade forgets that key instead of destroying it: hand it back as
# kms_key_arn.

removed {
  from = aws_kms_key.this

  lifecycle {
    destroy = false
  }
}

removed {
  from = aws_kms_alias.this

  lifecycle {
    destroy = false
  }
}
