# What the other files share. The stack: bucket.tf (objects and their lifecycle), functions.tf (the functions and
# what wakes them), failures.tf (where failed events go), sweep.tf (the schedule), iam.tf (who may do what), kms.tf,
# alarms.tf, budget.tf, dashboard.tf, destroy.tf (a check before destruction), site.tf (the studio's page).

data "aws_caller_identity" "current" {}

data "aws_partition" "current" {}

data "aws_region" "current" {}

locals {
  account_id = data.aws_caller_identity.current.account_id
  partition  = data.aws_partition.current.partition
  region     = data.aws_region.current.region
  dns_suffix = data.aws_partition.current.dns_suffix

  # Shared with the local invoker, so that an event takes the same way on a laptop.
  routes = jsondecode(file("${path.module}/routes.json")).routes

  packages = coalesce(var.packages, {
    for function in ["render", "assemble"] :
    function => "${path.module}/../../target/packages/${var.architecture}/rayfold-${function}.zip"
  })

  # `program`: which of the two packages it runs, and so which document of policies/ says what it may do with objects.
  functions = {
    render = merge(var.render, {
      program     = "render"
      description = "Renders one frame a script and keeps the manifest"
    })
    assemble = merge(var.assemble, {
      program     = "assemble"
      description = "Writes the animations, and sweeps"
    })
    # The assemble program once more, with a short timeout: a queue must hide a batch for longer than its reader may
    # take, and a record that fails once would wait for that long.
    record = merge(var.record, {
      program              = "assemble"
      tmp_mb               = 512
      reserved_concurrency = null
      description          = "Writes failed events into the manifests"
    })
  }

  # Those that events of the bucket wake.
  event_functions = toset([for route in local.routes : route.function])

  # Names of roles and dashboards are the account's, not the region's.
  global_name = "${var.name}-${local.region}"

  tags = merge({ Application = var.name }, var.tags)
}
