variable "name" {
  description = "Name of the stack"
  type        = string
  default     = "rayfold"
}

variable "region" {
  description = "Region to deploy to"
  type        = string
  default     = "us-east-1"
}

variable "packages" {
  description = "Paths of the functions' zip files; null takes what `cargo xtask package` wrote"
  type        = object({ render = string, assemble = string })
  default     = null
}

variable "site_folder" {
  description = "Folder of the page; null takes what `cargo xtask site` wrote"
  type        = string
  default     = null
}

variable "login_prefix" {
  description = "First part of the sign-in page's domain"
  type        = string
}

variable "budget_email" {
  description = "Address that gets messages about the cost"
  type        = string
}
