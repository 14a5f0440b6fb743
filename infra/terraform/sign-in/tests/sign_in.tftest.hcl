# Who gets credentials: people whom an administrator has invited, and nobody else.

mock_provider "aws" {
  mock_data "aws_region" {
    defaults = { region = "eu-central-1" }
  }

  mock_data "aws_partition" {
    defaults = { partition = "aws", dns_suffix = "amazonaws.com" }
  }

  mock_resource "aws_cognito_user_pool" {
    defaults = { id = "eu-central-1_AbCdEfGhI" }
  }

  mock_resource "aws_cognito_user_pool_client" {
    defaults = { id = "1example23456789" }
  }

  mock_resource "aws_cognito_identity_pool" {
    defaults = { id = "eu-central-1:11111111-2222-3333-4444-555555555555" }
  }
}

variables {
  name         = "demo"
  login_prefix = "demo-film"
  site_url     = "https://studio.example.com/"
  role_arn     = "arn:aws:iam::123456789012:role/demo-eu-central-1-person"
}

run "strangers_get_nothing" {
  assert {
    condition = alltrue([
      aws_cognito_user_pool.this.admin_create_user_config[0].allow_admin_create_user_only,
      !aws_cognito_identity_pool.this.allow_unauthenticated_identities,
      !aws_cognito_identity_pool.this.allow_classic_flow,
      join(" ", keys(aws_cognito_identity_pool_roles_attachment.this.roles)) == "authenticated",
      length(aws_cognito_identity_pool_roles_attachment.this.role_mapping) == 0,
      aws_cognito_identity_pool_roles_attachment.this.roles["authenticated"] == var.role_arn,
    ])
    error_message = "nobody may sign up, take credentials unknown, or choose a role"
  }
  assert {
    condition     = [for provider in aws_cognito_identity_pool.this.cognito_identity_providers : "${provider.provider_name} ${provider.client_id} ${provider.server_side_token_check}"] == ["cognito-idp.eu-central-1.amazonaws.com/eu-central-1_AbCdEfGhI 1example23456789 true"]
    error_message = "only the page's client of this user pool may vouch for people, and each time"
  }
}

run "the_page_has_no_secret_and_sees_no_password" {
  assert {
    condition = alltrue([
      !aws_cognito_user_pool_client.page.generate_secret,
      aws_cognito_user_pool_client.page.allowed_oauth_flows == toset(["code"]),
      aws_cognito_user_pool_client.page.explicit_auth_flows == toset(["ALLOW_REFRESH_TOKEN_AUTH"]),
      aws_cognito_user_pool_client.page.callback_urls == toset(["https://studio.example.com/studio.html"]),
      aws_cognito_user_pool_client.page.prevent_user_existence_errors == "ENABLED",
    ])
    error_message = "the page must redeem codes alone, and be the only place that they are sent to"
  }
  assert {
    condition = jsonencode(output.people) == jsonencode({
      client_id        = "1example23456789"
      identity_pool_id = "eu-central-1:11111111-2222-3333-4444-555555555555"
      user_pool_id     = "eu-central-1_AbCdEfGhI"
    })
    error_message = "the stack must get what its input people takes"
  }
}

run "codes" {
  variables {
    mfa = "ON"
  }

  assert {
    condition     = aws_cognito_user_pool.this.mfa_configuration == "ON" && aws_cognito_user_pool.this.software_token_mfa_configuration[0].enabled
    error_message = "one-time codes must be asked for"
  }
}

run "login_prefix_that_cognito_refuses" {
  command = plan
  variables {
    login_prefix = "my-cognito"
  }
  expect_failures = [var.login_prefix]
}

run "site_url_without_tls" {
  command = plan
  variables {
    site_url = "http://studio.example.com/"
  }
  expect_failures = [var.site_url]
}
