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

variable "render_concurrency" {
  description = "Invocations set aside for the render function, and its bound; null takes what the account has free. A new account has 10 in all, of which none can be set aside"
  type        = number
  default     = null
}

variable "kms_key_arn" {
  description = "ARN of the key that examples/key makes; null takes the keys that AWS manages"
  type        = string
  default     = null
}

variable "site_folder" {
  description = "Folder of the studio's page; null takes what `cargo xtask site` wrote"
  type        = string
  default     = null
}
