# A stack with the studio's page, where people who were invited sign in and submit, each to a folder of their own. Build
# packages and page first: cargo xtask package, cargo xtask site

provider "aws" {
  region = var.region
}

module "rayfold" {
  source = "../.."

  name        = var.name
  packages    = var.packages
  site        = true
  site_folder = var.site_folder

  login_prefix = var.login_prefix
  people       = module.sign_in.people

  # Each person can make the stack draw: bounds for a script, and a message about the cost.
  limits = {
    max_animation_frames = 2000
    max_frames           = 1000
    max_pixels           = 8294400 # 3840 x 2160
  }
  budget = {
    monthly_usd = 50
    emails      = [var.budget_email]
  }
}

module "sign_in" {
  source = "../../sign-in"

  name         = var.name
  login_prefix = var.login_prefix
  site_url     = module.rayfold.site_url
  role_arn     = module.rayfold.person_role_arn
}
