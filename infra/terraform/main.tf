# What the other files share. The stack: bucket.tf (objects and their lifecycle), functions.tf (the two functions and
# what wakes them), failures.tf (where failed events go), sweep.tf (the schedule), iam.tf (who may do what), kms.tf,
# alarms.tf, dashboard.tf.

data "aws_caller_identity" "current" {}

data "aws_partition" "current" {}

data "aws_region" "current" {}

locals {
  account_id = data.aws_caller_identity.current.account_id
  partition  = data.aws_partition.current.partition
  region     = data.aws_region.current.region

  bucket_name = coalesce(var.bucket_name, "${var.name}-${local.account_id}-${local.region}")

  # Shared with the local invoker, so that an event takes the same way on a laptop.
  routes = jsondecode(file("${path.module}/routes.json")).routes

  packages = coalesce(var.packages, {
    for function in ["render", "assemble"] :
    function => "${path.module}/../../target/packages/${var.architecture}/rayfold-${function}.zip"
  })

  functions = {
    render   = merge(var.render, { description = "Renders one frame a script and keeps the manifest" })
    assemble = merge(var.assemble, { description = "Writes the GIF, sweeps, and records failed events" })
  }

  kms_key_arn = one(aws_kms_key.this[*].arn)

  tags = merge({ Application = var.name }, var.tags)
}
