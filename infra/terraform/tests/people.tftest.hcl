# People who sign in on the page: each has a folder, and no right outside of it.

mock_provider "aws" {
  source = "./tests/mocks"
}

variables {
  name        = "demo"
  site        = true
  site_folder = "tests/site"
  packages = {
    render   = "tests/packages/rayfold-render.zip"
    assemble = "tests/packages/rayfold-assemble.zip"
  }
  login_prefix = "demo-film"
  people = {
    identity_pool_id = "eu-central-1:11111111-2222-3333-4444-555555555555"
    user_pool_id     = "eu-central-1_AbCdEfGhI"
    client_id        = "1example23456789"
  }
}

run "role" {
  assert {
    condition = jsondecode(aws_iam_role.person[0].assume_role_policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [{
        Effect    = "Allow"
        Principal = { Federated = "cognito-identity.amazonaws.com" }
        Action    = "sts:AssumeRoleWithWebIdentity"
        Condition = {
          StringEquals               = { "cognito-identity.amazonaws.com:aud" = "eu-central-1:11111111-2222-3333-4444-555555555555" }
          "ForAnyValue:StringEquals" = { "cognito-identity.amazonaws.com:amr" = "authenticated" }
        }
      }]
    }))
    error_message = "only people whom this identity pool knows, and who have signed in, may take the role"
  }
  assert {
    condition     = aws_iam_role.person[0].max_session_duration == 3600 && aws_iam_role.person[0].permissions_boundary == null && output.person_role_arn == "arn:aws:iam::123456789012:role/demo-eu-central-1-person"
    error_message = "credentials must end after an hour"
  }
}

run "rights" {
  assert {
    condition = jsondecode(aws_iam_role_policy.person[0].policy) == jsondecode(
      replace(replace(file("policies/person.json.tftpl"), "$${bucket_arn}", "arn:aws:s3:::demo-123456789012-eu-central-1"), "$${person}", "$${cognito-identity.amazonaws.com:sub}")
    )
    error_message = "a person must have the document that the tests enforce, with the identity in its place"
  }
  assert {
    condition = alltrue(flatten([for statement in jsondecode(aws_iam_role_policy.person[0].policy).Statement : [
      for name in flatten([try(statement.Condition.StringLike["s3:prefix"], []), statement.Sid == "List" ? [] : flatten([statement.Resource])]) :
      can(regex("^(arn:aws:s3:::demo-123456789012-eu-central-1/)?(scripts|frames|manifests|animations|retries)/[$][{]cognito-identity.amazonaws.com:sub[}]/[*](/1|[.](png|error[.]json|begun-[?]))?$", name))
    ]]))
    error_message = "each right must end at the person's own folder, the slash included"
  }
  assert {
    condition     = [for statement in jsondecode(aws_iam_role_policy.person[0].policy).Statement : try(keys(statement.Condition), [])] == [["StringLike"], [], [], []]
    error_message = "a listing without a prefix must be refused"
  }
  assert {
    condition = join(" ", sort(distinct(flatten([
      for statement in jsondecode(aws_iam_role_policy.person[0].policy).Statement : statement.Action
    ])))) == "s3:DeleteObject s3:GetObject s3:ListBucket s3:PutObject"
    error_message = "no old versions, tags, ACLs, listings of uploads, or settings"
  }
  assert {
    condition = jsonencode([for statement in jsondecode(aws_iam_role_policy.person[0].policy).Statement :
      [for name in flatten([statement.Resource]) : trimprefix(name, "arn:aws:s3:::demo-123456789012-eu-central-1/")] if contains(["s3:PutObject", "s3:DeleteObject"], statement.Action)
      ]) == jsonencode([
      ["scripts/$${cognito-identity.amazonaws.com:sub}/*", "retries/$${cognito-identity.amazonaws.com:sub}/*/1"],
      ["scripts/$${cognito-identity.amazonaws.com:sub}/*", "frames/$${cognito-identity.amazonaws.com:sub}/*.error.json", "frames/$${cognito-identity.amazonaws.com:sub}/*.begun-?"],
    ])
    error_message = "a person writes scripts and first orders to draw again, and deletes scripts and what a failure has left"
  }
}

run "with_a_key" {
  variables {
    kms_key_arn = "arn:aws:kms:eu-central-1:123456789012:key/11111111-2222-3333-4444-555555555555"
  }

  assert {
    condition = jsondecode(aws_iam_role_policy.person[0].policy).Statement[4] == jsondecode(jsonencode({
      Sid       = "UseTheKeyThroughTheBucket"
      Effect    = "Allow"
      Action    = ["kms:Decrypt", "kms:GenerateDataKey"]
      Resource  = "arn:aws:kms:eu-central-1:123456789012:key/11111111-2222-3333-4444-555555555555"
      Condition = { StringEquals = { "kms:ViaService" = ["s3.eu-central-1.amazonaws.com"] } }
    }))
    error_message = "a person needs the key for the bucket's objects"
  }
}

run "page" {
  assert {
    condition = jsondecode(aws_s3_object.site["rayfold.json"].content) == jsondecode(jsonencode({
      bucket   = "demo-123456789012-eu-central-1"
      region   = "eu-central-1"
      endpoint = "https://demo-123456789012-eu-central-1.s3.eu-central-1.amazonaws.com"
      signIn = {
        region         = "eu-central-1"
        identityPoolId = "eu-central-1:11111111-2222-3333-4444-555555555555"
        userPoolId     = "eu-central-1_AbCdEfGhI"
        clientId       = "1example23456789"
        loginUrl       = "https://demo-film.auth.eu-central-1.amazoncognito.com"
      }
    }))
    error_message = "the page must know its stack"
  }
  assert {
    condition = alltrue([for policy in [
      aws_s3_object.site["studio.html"].content,
      aws_cloudfront_response_headers_policy.site[0].security_headers_config[0].content_security_policy[0].content_security_policy,
    ] : strcontains(policy, "; connect-src 'self' https://demo-123456789012-eu-central-1.s3.eu-central-1.amazonaws.com https://cognito-identity.eu-central-1.amazonaws.com https://demo-film.auth.eu-central-1.amazoncognito.com;")])
    error_message = "the page may talk to its bucket and to Cognito, and to nobody else"
  }
  assert {
    condition     = can(regex("\"rayfold-[0-9a-f]{16}\"", aws_s3_object.site["offline.js"].content)) && !strcontains(aws_s3_object.site["offline.js"].content, "0123456789abcdef")
    error_message = "a browser that has kept the page must see that it has changed"
  }
  assert {
    condition     = alltrue([for file in ["rayfold.json", "studio.html", "offline.js"] : aws_s3_object.site[file].content_encoding == null && aws_s3_object.site[file].source == null])
    error_message = "what is written here is not compressed"
  }
}

run "only_the_page_may_use_the_bucket_in_a_browser" {
  assert {
    condition = alltrue([
      one(aws_s3_bucket_cors_configuration.this[0].cors_rule).allowed_origins == toset(["https://d111111abcdef8.cloudfront.net"]),
      one(aws_s3_bucket_cors_configuration.this[0].cors_rule).allowed_methods == toset(["DELETE", "GET", "HEAD", "PUT"]),
    ])
    error_message = "pages of others may not use the bucket"
  }
}

run "limits_hold_for_people" {
  assert {
    condition = alltrue([for function in ["render", "assemble"] :
      aws_lambda_function.this[function].environment[0].variables["RAYFOLD_MAX_ANIMATION_FRAMES"] == "100000"
    ]) && length(aws_cloudwatch_metric_alarm.function) > 0
    error_message = "what people upload must meet the same limits and alarms"
  }
}

run "without_the_page" {
  command = plan
  variables {
    site        = false
    site_folder = null
  }
  expect_failures = [var.login_prefix]
}

run "people_without_a_page_to_sign_in" {
  command = plan
  variables {
    login_prefix = null
  }
  expect_failures = [var.people]
}

run "no_identity_pool" {
  command = plan
  variables {
    people = { identity_pool_id = "*", user_pool_id = "a", client_id = "b" }
  }
  expect_failures = [var.people]
}

run "login_prefix_with_another_source" {
  command = plan
  variables {
    login_prefix = "a.example.com https://b"
  }
  expect_failures = [var.login_prefix]
}
