# People who sign in on the studio's page (`login_prefix` and `people`): credentials for an hour, and rights in a folder of their own. Who they are
# is known to a Cognito identity pool, which the module sign-in makes.

locals {
  signs_in = var.people == null ? 0 : 1

  endpoint  = "https://${local.bucket}.s3.${local.region}.${local.dns_suffix}"
  login_url = "https://${coalesce(var.login_prefix, "none")}.auth.${local.region}.amazoncognito.com"

  # Whom the page talks to when somebody signs in. Nothing of `people` may be in it: Cognito's client names the page's address.
  site_talks_to = var.login_prefix == null ? "connect-src 'self'" : join(" ", [
    "connect-src 'self'",
    local.endpoint,
    "https://cognito-identity.${local.region}.${local.dns_suffix}",
    local.login_url,
  ])

  # What the page reads to know its stack.
  site_config = [for people in var.people[*] : jsonencode({
    bucket   = local.bucket
    region   = local.region
    endpoint = local.endpoint
    signIn = {
      region         = local.region
      identityPoolId = people.identity_pool_id
      userPoolId     = people.user_pool_id
      clientId       = people.client_id
      loginUrl       = local.login_url
    }
  })]

  # The files that say so, in place of those in the folder: the page's own policy, and the version by which a browser that
  # has kept the page sees that there is a new one.
  site_written = var.people == null ? {} : {
    "rayfold.json" = one(local.site_config)
    "studio.html"  = replace(local.site_page, "connect-src 'self'", local.site_talks_to)
    "offline.js" = replace(
      file("${local.site_folder}/offline.js"),
      "/rayfold-[0-9a-f]{16}/",
      "rayfold-${substr(sha256("${filesha256("${local.site_folder}/offline.js")}${one(local.site_config)}"), 0, 16)}",
    )
  }
}

resource "aws_iam_role" "person" {
  count = local.signs_in

  name                 = "${local.global_name}-person"
  path                 = var.role_path
  description          = "What people who sign in on the page of ${var.name} may do"
  permissions_boundary = var.permissions_boundary_arn
  max_session_duration = 3600
  tags                 = local.tags

  assume_role_policy = jsonencode({
    Version = "2012-10-17"
    Statement = [{
      Effect    = "Allow"
      Principal = { Federated = "cognito-identity.amazonaws.com" }
      Action    = "sts:AssumeRoleWithWebIdentity"
      Condition = {
        StringEquals = {
          "cognito-identity.amazonaws.com:aud" = var.people.identity_pool_id
        }
        "ForAnyValue:StringEquals" = {
          "cognito-identity.amazonaws.com:amr" = "authenticated"
        }
      }
    }]
  })
}

resource "aws_iam_role_policy" "person" {
  count = local.signs_in

  name   = "own-folder"
  role   = aws_iam_role.person[0].id
  policy = local.person_policy
}

locals {
  person_policy = jsonencode({
    Version = "2012-10-17"
    Statement = concat(
      jsondecode(templatefile("${path.module}/policies/person.json.tftpl", {
        bucket_arn = local.bucket_arn
        # IAM puts the identity in its place at each request: a request without one is allowed nothing.
        person = "$${cognito-identity.amazonaws.com:sub}"
      })).Statement,
      local.key_statements_of_people["person"],
    )
  })
}

# The page of another site cannot use the bucket by the browser of a person who is signed in here.
resource "aws_s3_bucket_cors_configuration" "this" {
  count = local.made_here * local.signs_in

  bucket = aws_s3_bucket.this[0].bucket

  cors_rule {
    allowed_origins = [trimsuffix(one(local.site_url), "/")]
    allowed_methods = ["DELETE", "GET", "HEAD", "PUT"]
    allowed_headers = ["authorization", "content-type", "x-amz-*"]
    expose_headers  = ["ETag", "x-amz-meta-generation"]
    max_age_seconds = 3600
  }
}
