# A stack with every setting at its default. Build the packages first: cargo xtask package

provider "aws" {
  region = var.region
}

module "rayfold" {
  source = "../.."

  name     = var.name
  packages = var.packages
}
