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
