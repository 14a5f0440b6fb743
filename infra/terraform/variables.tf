variable "name" {
  description = "Prefix of every name in the stack: lower-case letters, digits and hyphens, 3 to 32 characters"
  type        = string
  nullable    = false

  validation {
    condition     = can(regex("^[a-z][a-z0-9-]{1,30}[a-z0-9]$", var.name)) && !strcontains(var.name, "--")
    error_message = "name must be 3 to 32 lower-case letters, digits and single hyphens, begin with a letter and not end with a hyphen."
  }
}

variable "tags" {
  description = "Tags for every resource that takes them"
  type        = map(string)
  default     = {}
  nullable    = false
}

# Bucket

variable "bucket_name" {
  description = "Name of the bucket; null gives NAME-ACCOUNT-REGION, which nobody else can have taken"
  type        = string
  default     = null

  validation {
    condition     = var.bucket_name == null ? true : can(regex("^[a-z0-9][a-z0-9-]{1,61}[a-z0-9]$", var.bucket_name))
    error_message = "bucket_name must be 3 to 63 lower-case letters, digits and hyphens (no dots: they break TLS to the bucket's own host name)."
  }
}

variable "existing_bucket" {
  description = "Name of a bucket of yours, in the region of the stack, to use in place of a new one; null makes one. Of yours only the notifications are set, all of them: what else you had there is removed"
  type        = string
  default     = null

  validation {
    condition     = var.existing_bucket == null || (var.bucket_name == null && !var.force_destroy && var.access_log_bucket == null && length(var.bucket_policy_statements) == 0)
    error_message = "With existing_bucket leave out bucket_name, force_destroy, access_log_bucket and bucket_policy_statements: the settings of a bucket that you give stay yours."
  }
}

variable "force_destroy" {
  description = "Whether `terraform destroy` may delete a bucket that still holds objects, all their versions included"
  type        = bool
  default     = false
  nullable    = false
}

variable "noncurrent_version_days" {
  description = "Days to keep overwritten or deleted scripts and animations; the pipeline's own working objects are kept one day"
  type        = number
  default     = 30
  nullable    = false

  validation {
    condition     = var.noncurrent_version_days >= 1 && floor(var.noncurrent_version_days) == var.noncurrent_version_days
    error_message = "noncurrent_version_days must be a whole number of at least 1."
  }
}

variable "claim_days" {
  description = "Days after which claims (`assemblies/`) and retry orders (`retries/`), which are spent within minutes, expire"
  type        = number
  default     = 7
  nullable    = false

  validation {
    condition     = var.claim_days >= 1 && floor(var.claim_days) == var.claim_days
    error_message = "claim_days must be a whole number of at least 1."
  }
}

variable "access_log_bucket" {
  description = "Name of an existing bucket that takes the server access log; null writes none"
  type        = string
  default     = null
}

variable "access_log_prefix" {
  description = "Prefix of the access log's keys"
  type        = string
  default     = "rayfold/"
  nullable    = false
}

variable "kms_key_arn" {
  description = "ARN of a KMS key of yours that encrypts bucket, queues, logs and function settings; null takes the keys that AWS manages. It must outlive the bucket. ETags then change at each upload, so that uploading the same bytes again renders them again"
  type        = string
  default     = null

  validation {
    condition     = var.kms_key_arn == null ? true : can(regex("^arn:[a-z-]+:kms:[a-z0-9-]+:[0-9]{12}:key/", var.kms_key_arn))
    error_message = "kms_key_arn must be the ARN of a KMS key, not of an alias."
  }
}

variable "former_kms_key_arns" {
  description = "ARNs of the keys that objects of the bucket may still be encrypted with, so that they can be read after kms_key_arn has changed"
  type        = list(string)
  default     = []
  nullable    = false

  validation {
    condition     = alltrue([for arn in var.former_kms_key_arns : can(regex("^arn:[a-z-]+:kms:[a-z0-9-]+:[0-9]{12}:key/", arn))])
    error_message = "former_kms_key_arns must be ARNs of KMS keys."
  }
}

variable "bucket_policy_statements" {
  description = "Further statements for the bucket's policy, as objects with the keys of IAM's JSON"
  type        = any
  default     = []
  nullable    = false

  validation {
    condition     = can([for statement in var.bucket_policy_statements : statement.Effect])
    error_message = "bucket_policy_statements must be a list of statements, each with an Effect."
  }
}

variable "eventbridge_enabled" {
  description = "Whether the bucket tells EventBridge of its objects, so that rules there can act on a finished file (`animations/`)"
  type        = bool
  default     = false
  nullable    = false
}

variable "finished_topic_arn" {
  description = "ARN of an SNS topic that gets a message for each finished file (`animations/`); its policy must let s3.amazonaws.com publish. Null sends none"
  type        = string
  default     = null

  validation {
    condition     = var.finished_topic_arn == null ? true : can(regex("^arn:[a-z-]+:sns:[a-z0-9-]+:[0-9]{12}:", var.finished_topic_arn))
    error_message = "finished_topic_arn must be the ARN of an SNS topic."
  }
}

# Functions

variable "architecture" {
  description = "Instruction set of the functions, `x86_64` or `arm64`; the packages must be built for it"
  type        = string
  default     = "x86_64"
  nullable    = false

  validation {
    condition     = contains(["x86_64", "arm64"], var.architecture)
    error_message = "architecture must be x86_64 or arm64."
  }
}

variable "packages" {
  description = "Paths of the programs' zip files; null takes what `cargo xtask package` wrote for the architecture"
  type = object({
    render   = string
    assemble = string
  })
  default = null
}

variable "render" {
  description = "Size of the render function. 1,769 MB are one vCPU; the price is memory times duration. Without reserved concurrency it shares the account's"
  type = object({
    memory_mb            = optional(number, 1769)
    timeout_s            = optional(number, 300)
    tmp_mb               = optional(number, 512)
    reserved_concurrency = optional(number)
  })
  default  = {}
  nullable = false

  validation {
    condition     = var.render.memory_mb >= 128 && var.render.memory_mb <= 10240 && floor(var.render.memory_mb) == var.render.memory_mb
    error_message = "render.memory_mb must be a whole number from 128 to 10240."
  }
  validation {
    condition     = var.render.timeout_s >= 10 && var.render.timeout_s <= 900 && floor(var.render.timeout_s) == var.render.timeout_s
    error_message = "render.timeout_s must be a whole number from 10 to 900."
  }
  validation {
    condition     = var.render.tmp_mb >= 512 && var.render.tmp_mb <= 10240 && floor(var.render.tmp_mb) == var.render.tmp_mb
    error_message = "render.tmp_mb must be a whole number from 512 to 10240."
  }
  validation {
    condition     = var.render.reserved_concurrency == null ? true : var.render.reserved_concurrency >= 1
    error_message = "render.reserved_concurrency must be at least 1: 0 would stop the function, and events would be lost after event_max_age_s."
  }
}

variable "assemble" {
  description = "Size of the assemble function, which writes the animations and sweeps"
  type = object({
    memory_mb            = optional(number, 3008)
    timeout_s            = optional(number, 900)
    tmp_mb               = optional(number, 512)
    reserved_concurrency = optional(number)
  })
  default  = {}
  nullable = false

  validation {
    condition     = var.assemble.memory_mb >= 128 && var.assemble.memory_mb <= 10240 && floor(var.assemble.memory_mb) == var.assemble.memory_mb
    error_message = "assemble.memory_mb must be a whole number from 128 to 10240."
  }
  validation {
    condition     = var.assemble.timeout_s >= 10 && var.assemble.timeout_s <= 900 && floor(var.assemble.timeout_s) == var.assemble.timeout_s
    error_message = "assemble.timeout_s must be a whole number from 10 to 900."
  }
  validation {
    condition     = var.assemble.tmp_mb >= 512 && var.assemble.tmp_mb <= 10240 && floor(var.assemble.tmp_mb) == var.assemble.tmp_mb
    error_message = "assemble.tmp_mb must be a whole number from 512 to 10240."
  }
  validation {
    condition     = var.assemble.reserved_concurrency == null ? true : var.assemble.reserved_concurrency >= 2
    error_message = "assemble.reserved_concurrency must be at least 2: one for claims and one for the sweep."
  }
}

variable "record" {
  description = "Size of the record function, which writes failed events into the manifests. A record that fails once is tried again after six times the timeout"
  type = object({
    memory_mb = optional(number, 512)
    timeout_s = optional(number, 60)
  })
  default  = {}
  nullable = false

  validation {
    condition     = var.record.memory_mb >= 128 && var.record.memory_mb <= 10240 && floor(var.record.memory_mb) == var.record.memory_mb
    error_message = "record.memory_mb must be a whole number from 128 to 10240."
  }
  validation {
    condition     = var.record.timeout_s >= 10 && var.record.timeout_s <= 900 && floor(var.record.timeout_s) == var.record.timeout_s
    error_message = "record.timeout_s must be a whole number from 10 to 900."
  }
}

variable "limits" {
  description = "What a script may ask for: Traces (each is an invocation), bands of a frame that is too big for one invocation (each is one, too; with 1 none is cut), pixels of an image, objects, lights, bytes; and how many frames an animation may have, beyond which no more are drawn. Null pixels and objects are as many as fit render.memory_mb: 64,000,000 and 1,817,300 with its default"
  type = object({
    max_animation_frames = optional(number, 100000)
    max_bands            = optional(number, 64)
    max_frames           = optional(number, 10000)
    max_pixels           = optional(number)
    max_objects          = optional(number)
    max_lights           = optional(number, 1024)
    max_script_bytes     = optional(number, 268435456)
  })
  default  = {}
  nullable = false

  validation {
    condition     = alltrue([for limit in values(var.limits) : limit == null ? true : limit >= 1 && floor(limit) == limit])
    error_message = "Each of limits must be a whole number of at least 1."
  }
}

variable "vpc" {
  description = "Subnets and security groups of a VPC for the functions, which there need an endpoint for S3; null puts them into none"
  type = object({
    subnet_ids         = list(string)
    security_group_ids = list(string)
  })
  default = null

  validation {
    condition     = var.vpc == null ? true : length(var.vpc.subnet_ids) > 0 && length(var.vpc.security_group_ids) > 0
    error_message = "vpc must name at least one subnet and one security group."
  }
}

variable "code_signing_config_arn" {
  description = "ARN of a code signing configuration that the packages must satisfy; null asks for no signature"
  type        = string
  default     = null

  validation {
    condition     = var.code_signing_config_arn == null ? true : can(regex("^arn:[a-z-]+:lambda:[a-z0-9-]+:[0-9]{12}:code-signing-config:", var.code_signing_config_arn))
    error_message = "code_signing_config_arn must be the ARN of a code signing configuration."
  }
}

variable "role_path" {
  description = "Path of every role of the stack"
  type        = string
  default     = "/"
  nullable    = false

  validation {
    condition     = can(regex("^/([!-~]+/)?$", var.role_path)) && length(var.role_path) <= 512
    error_message = "role_path must begin and end with a slash."
  }
}

variable "permissions_boundary_arn" {
  description = "ARN of a policy that bounds every role of the stack; null sets none"
  type        = string
  default     = null

  validation {
    condition     = var.permissions_boundary_arn == null ? true : can(regex("^arn:[a-z-]+:iam::([0-9]{12}|aws):policy/", var.permissions_boundary_arn))
    error_message = "permissions_boundary_arn must be the ARN of an IAM policy."
  }
}

variable "xray_tracing" {
  description = "Whether X-Ray samples the invocations"
  type        = bool
  default     = true
  nullable    = false
}

variable "log_level" {
  description = "Least severe level that the functions log: TRACE, DEBUG, INFO, WARN, ERROR or FATAL"
  type        = string
  default     = "INFO"
  nullable    = false

  validation {
    condition     = contains(["TRACE", "DEBUG", "INFO", "WARN", "ERROR", "FATAL"], var.log_level)
    error_message = "log_level must be TRACE, DEBUG, INFO, WARN, ERROR or FATAL."
  }
}

variable "log_retention_days" {
  description = "Days to keep the functions' logs"
  type        = number
  default     = 30
  nullable    = false

  validation {
    condition     = contains([1, 3, 5, 7, 14, 30, 60, 90, 120, 150, 180, 365, 400, 545, 731, 1096, 1827, 2192, 2557, 2922, 3288, 3653], var.log_retention_days)
    error_message = "log_retention_days must be one of CloudWatch's: 1, 3, 5, 7, 14, 30, 60, 90, 120, 150, 180, 365, 400, 545, 731, 1096, 1827, 2192, 2557, 2922, 3288 or 3653."
  }
}

# Events

variable "event_retries" {
  description = "How often Lambda runs a failed event again before it goes to the failure queue: 0, 1 or 2"
  type        = number
  default     = 2
  nullable    = false

  validation {
    condition     = contains([0, 1, 2], var.event_retries)
    error_message = "event_retries must be 0, 1 or 2."
  }
}

variable "event_max_age_s" {
  description = "Seconds that an event may wait for a free invocation before it goes to the failure queue, at most 21,600"
  type        = number
  default     = 21600
  nullable    = false

  validation {
    condition     = var.event_max_age_s >= 60 && var.event_max_age_s <= 21600 && floor(var.event_max_age_s) == var.event_max_age_s
    error_message = "event_max_age_s must be a whole number from 60 to 21600."
  }
}

variable "sweep_minutes" {
  description = "Minutes between two sweeps, which heal what lost events left behind; each lists every animation of the bucket, and so costs requests"
  type        = number
  default     = 15
  nullable    = false

  validation {
    condition     = var.sweep_minutes >= 2 && var.sweep_minutes <= 1440 && floor(var.sweep_minutes) == var.sweep_minutes
    error_message = "sweep_minutes must be a whole number from 2 to 1440."
  }
}

# The studio's page

variable "site" {
  description = "Whether to serve the studio's static page from a bucket of its own behind CloudFront"
  type        = bool
  default     = false
  nullable    = false

  validation {
    condition     = !var.site || length(var.name) <= 30
    error_message = "With site, name may have at most 30 characters, for the name of the page's bucket."
  }
}

variable "site_folder" {
  description = "Folder of the page; null takes what `cargo xtask site` wrote"
  type        = string
  default     = null

  validation {
    condition     = !var.site || fileexists("${coalesce(var.site_folder, "${path.module}/../../target/site")}/studio.html")
    error_message = "The page is missing: `cargo xtask site` builds it, or name its folder as site_folder."
  }
}

variable "site_domain" {
  description = "Domain of the page, and the ARN of an ACM certificate for it in us-east-1; null takes CloudFront's own domain. Point the domain at the output `site_domain_name`"
  type        = object({ name = string, certificate_arn = string })
  default     = null

  validation {
    condition     = var.site_domain == null ? true : can(regex("^arn:[a-z-]+:acm:us-east-1:[0-9]{12}:certificate/", var.site_domain.certificate_arn))
    error_message = "site_domain.certificate_arn must be the ARN of an ACM certificate in us-east-1: CloudFront takes no other."
  }
  validation {
    condition     = var.site_domain == null ? true : can(regex("^[a-z0-9-]+([.][a-z0-9-]+)+$", var.site_domain.name))
    error_message = "site_domain.name must be a domain, such as studio.example.com."
  }
}

variable "site_price_class" {
  description = "Where CloudFront serves the page from: `PriceClass_100` (North America, Europe and Israel), `PriceClass_200` or `PriceClass_All`"
  type        = string
  default     = "PriceClass_100"
  nullable    = false

  validation {
    condition     = contains(["PriceClass_100", "PriceClass_200", "PriceClass_All"], var.site_price_class)
    error_message = "site_price_class must be PriceClass_100, PriceClass_200 or PriceClass_All."
  }
}

variable "login_prefix" {
  description = "First part of the domain of Cognito's sign-in page, for people who submit from the page, each to a folder of their own; null lets nobody in. It goes with `people`"
  type        = string
  default     = null

  validation {
    condition     = var.login_prefix == null || var.site
    error_message = "login_prefix needs the page: site = true."
  }
  validation {
    condition     = var.login_prefix == null ? true : can(regex("^[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?$", var.login_prefix))
    error_message = "login_prefix must be lower-case letters, digits and hyphens, at most 63."
  }
}

variable "people" {
  description = "The identity pool whose people may submit from the page, and the user pool and client by which they sign in: the output `people` of the module `sign-in`. It goes with `login_prefix`"
  type = object({
    identity_pool_id = string
    user_pool_id     = string
    client_id        = string
  })
  default = null

  validation {
    condition     = (var.people == null) == (var.login_prefix == null)
    error_message = "people and login_prefix go together."
  }
  validation {
    condition     = var.people == null ? true : can(regex("^[a-z0-9:-]+$", var.people.identity_pool_id))
    error_message = "people.identity_pool_id must be an identity pool's, such as eu-central-1:11111111-2222-3333-4444-555555555555, in the region of the stack."
  }
}

# Watching

variable "alarms_enabled" {
  description = "Whether to create the alarms"
  type        = bool
  default     = true
  nullable    = false
}

variable "alarm_actions" {
  description = "ARNs, of SNS topics for example, that get a message when an alarm goes off and when it is over"
  type        = list(string)
  default     = []
  nullable    = false

  validation {
    condition     = alltrue([for arn in var.alarm_actions : startswith(arn, "arn:")])
    error_message = "alarm_actions must be ARNs."
  }
}

variable "alarm_thresholds" {
  description = "From where on the alarms go off: percent of invocations that fail, throttled invocations, percent of the timeout, age of waiting events and of failed ones, dropped events, unhandled ones, dead letters"
  type = object({
    error_percent    = optional(number, 10)
    throttles        = optional(number, 1)
    duration_percent = optional(number, 90)
    event_age_s      = optional(number, 3600)
    failure_age_s    = optional(number, 1800)
    dropped_events   = optional(number, 1)
    unhandled        = optional(number, 1)
    dead_letters     = optional(number, 1)
  })
  default  = {}
  nullable = false

  validation {
    condition     = alltrue([for threshold in values(var.alarm_thresholds) : threshold > 0])
    error_message = "Each of alarm_thresholds must be above 0."
  }
  validation {
    condition     = var.alarm_thresholds.error_percent <= 100 && var.alarm_thresholds.duration_percent <= 100
    error_message = "alarm_thresholds.error_percent and duration_percent must be at most 100."
  }
}

variable "runbook_url" {
  description = "Address of RUNBOOK.md, or of your own page with the same headings, for the texts of the alarms"
  type        = string
  default     = "infra/terraform/RUNBOOK.md"
  nullable    = false
}

variable "budget" {
  description = "Dollars a month from which the recipients get a message about the cost of the stack: at 80 % spent, and at 100 % forecast. It needs the tag Application to be activated for cost allocation; null sets none"
  type = object({
    monthly_usd = number
    emails      = optional(list(string), [])
    topic_arns  = optional(list(string), [])
  })
  default = null

  validation {
    condition     = var.budget == null ? true : var.budget.monthly_usd > 0
    error_message = "budget.monthly_usd must be above 0."
  }
  validation {
    condition     = var.budget == null ? true : length(var.budget.emails) + length(var.budget.topic_arns) > 0
    error_message = "budget must name somebody to tell, in emails or topic_arns."
  }
}

variable "dashboard_enabled" {
  description = "Whether to create the CloudWatch dashboard"
  type        = bool
  default     = true
  nullable    = false
}
