# Cognito's part of signing in on the studio's page: who the people are (a user pool), and temporary credentials for them (an
# identity pool). What they may do is the stack's to say: it makes their role (people.tf beside this folder).

data "aws_region" "current" {}

data "aws_partition" "current" {}

locals {
  region     = data.aws_region.current.region
  dns_suffix = data.aws_partition.current.dns_suffix
  tags       = merge({ Application = var.name }, var.tags)
}

resource "aws_cognito_user_pool" "this" {
  name                     = "${var.name}-people"
  username_attributes      = ["email"]
  auto_verified_attributes = ["email"]
  mfa_configuration        = var.mfa
  user_pool_tier           = "LITE"
  deletion_protection      = var.deletion_protection ? "ACTIVE" : "INACTIVE"
  tags                     = local.tags

  # Nobody signs up: an administrator invites (`aws cognito-idp admin-create-user`).
  admin_create_user_config {
    allow_admin_create_user_only = true
  }

  username_configuration {
    case_sensitive = false
  }

  password_policy {
    minimum_length                   = 12
    require_lowercase                = true
    require_uppercase                = true
    require_numbers                  = true
    require_symbols                  = false
    temporary_password_validity_days = 7
  }

  account_recovery_setting {
    recovery_mechanism {
      name     = "verified_email"
      priority = 1
    }
  }

  dynamic "software_token_mfa_configuration" {
    for_each = var.mfa == "OFF" ? [] : [true]

    content {
      enabled = true
    }
  }
}

# The page that asks for the password: Cognito's, so that the studio's page never sees one.
resource "aws_cognito_user_pool_domain" "this" {
  domain       = var.login_prefix
  user_pool_id = aws_cognito_user_pool.this.id
}

# A page keeps no secret: it proves by PKCE that the code which it redeems was meant for it.
resource "aws_cognito_user_pool_client" "page" {
  name                                 = "${var.name}-page"
  user_pool_id                         = aws_cognito_user_pool.this.id
  generate_secret                      = false
  allowed_oauth_flows_user_pool_client = true
  allowed_oauth_flows                  = ["code"]
  allowed_oauth_scopes                 = ["openid"]
  callback_urls                        = ["${var.site_url}studio.html"]
  logout_urls                          = ["${var.site_url}studio.html"]
  supported_identity_providers         = ["COGNITO"]
  explicit_auth_flows                  = ["ALLOW_REFRESH_TOKEN_AUTH"]
  prevent_user_existence_errors        = "ENABLED"
  enable_token_revocation              = true
  read_attributes                      = ["email"]
  write_attributes                     = ["email"]

  # A page that is open for longer asks for the password again.
  id_token_validity      = 60
  access_token_validity  = 60
  refresh_token_validity = 1

  token_validity_units {
    id_token      = "minutes"
    access_token  = "minutes"
    refresh_token = "hours"
  }
}

resource "aws_cognito_identity_pool" "this" {
  identity_pool_name               = "${var.name}-people"
  allow_unauthenticated_identities = false
  allow_classic_flow               = false
  tags                             = local.tags

  cognito_identity_providers {
    client_id     = aws_cognito_user_pool_client.page.id
    provider_name = "cognito-idp.${local.region}.${local.dns_suffix}/${aws_cognito_user_pool.this.id}"
    # A person who was disabled or removed gets no further credentials.
    server_side_token_check = true
  }
}

resource "aws_cognito_identity_pool_roles_attachment" "this" {
  identity_pool_id = aws_cognito_identity_pool.this.id
  roles            = { authenticated = var.role_arn }
}
