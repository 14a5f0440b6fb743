variable "name" {
  description = "Name of the stack whose objects it encrypts"
  type        = string
  default     = "rayfold"
}

variable "region" {
  description = "Region of the stack"
  type        = string
  default     = "us-east-1"
}
