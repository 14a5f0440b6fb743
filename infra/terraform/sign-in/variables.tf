variable "name" {
  description = "Name of the stack"
  type        = string
  nullable    = false
}

variable "login_prefix" {
  description = "First part of the sign-in page's domain, LOGIN_PREFIX.auth.REGION.amazoncognito.com, which nobody else in the region may have taken: the stack's input of this name"
  type        = string
  nullable    = false

  validation {
    condition     = can(regex("^[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?$", var.login_prefix)) && !can(regex("aws|amazon|cognito", var.login_prefix))
    error_message = "login_prefix must be lower-case letters, digits and hyphens, at most 63, without aws, amazon and cognito."
  }
}

variable "site_url" {
  description = "Address of the page: the stack's output `site_url`"
  type        = string
  nullable    = false

  validation {
    condition     = can(regex("^https://[^/]+/$", var.site_url))
    error_message = "site_url must be https://HOST/."
  }
}

variable "role_arn" {
  description = "ARN of the role of people who sign in: the stack's output `person_role_arn`"
  type        = string
  nullable    = false
}

variable "mfa" {
  description = "Whether people give a one-time code beside their password: `OFF`, `OPTIONAL` or `ON`"
  type        = string
  default     = "OPTIONAL"
  nullable    = false

  validation {
    condition     = contains(["OFF", "OPTIONAL", "ON"], var.mfa)
    error_message = "mfa must be OFF, OPTIONAL or ON."
  }
}

variable "deletion_protection" {
  description = "Whether Cognito refuses to delete the people's accounts"
  type        = bool
  default     = true
  nullable    = false
}

variable "tags" {
  description = "Tags for every resource that takes them"
  type        = map(string)
  default     = {}
  nullable    = false
}
