output "bucket" {
  description = "Name of the bucket"
  value       = local.bucket
}

output "bucket_arn" {
  description = "ARN of the bucket"
  value       = local.bucket_arn
}

output "sync_command" {
  description = "Uploads the folder FOLDER as the animation FOLDER; the GIF appears as animations/FOLDER.gif, or the files that animation.json asks for"
  value       = "aws s3 sync FOLDER s3://${local.bucket}/scripts/FOLDER/ --region ${local.region}"
}

output "submit_command" {
  description = "Checks the folder FOLDER, uploads what changed, waits, and downloads the GIF, or the files that animation.json asks for"
  value       = "AWS_REGION=${local.region} rayfold submit FOLDER --bucket ${local.bucket}"
}

output "function_names" {
  description = "Names of the functions, by `render`, `assemble` and `record`"
  value       = { for function, resource in aws_lambda_function.this : function => resource.function_name }
}

output "function_arns" {
  description = "ARNs of the functions, by `render`, `assemble` and `record`"
  value       = { for function, resource in aws_lambda_function.this : function => resource.arn }
}

output "role_arns" {
  description = "ARNs of the functions' roles, by `render`, `assemble` and `record`"
  value       = { for function, resource in aws_iam_role.function : function => resource.arn }
}

output "log_group_names" {
  description = "Names of the functions' log groups, by `render`, `assemble` and `record`"
  value       = { for function, resource in aws_cloudwatch_log_group.this : function => resource.name }
}

output "failure_queue_url" {
  description = "URL of the queue of events that a function could not handle, which the record function reads"
  value       = aws_sqs_queue.failures.url
}

output "dead_letter_queue_url" {
  description = "URL of the queue of events that nothing could handle"
  value       = aws_sqs_queue.dead_letters.url
}

output "user_policies" {
  description = "IAM policies for people, as JSON, by `viewer` (status, fetch), `uploader` (submit too) and `operator` (retry and remove too)"
  value       = local.user_policies
}

output "dashboard_url" {
  description = "Address of the dashboard, null without one"
  value       = one([for name in aws_cloudwatch_dashboard.this[*].dashboard_name : "https://${local.region}.${local.console}/cloudwatch/home?region=${local.region}#dashboards/dashboard/${name}"])
}

output "site_url" {
  description = "Address of the studio's page, null without one"
  value       = one(local.site_url)
}

output "site_domain_name" {
  description = "CloudFront's name for the page, for an alias or CNAME of your own domain; null without a page"
  value       = one(aws_cloudfront_distribution.site[*].domain_name)
}

output "site_bucket" {
  description = "Name of the bucket of the page, null without one"
  value       = one(aws_s3_bucket.site[*].bucket)
}

output "person_role_arn" {
  description = "ARN of the role of people who sign in on the page, for the identity pool; null without `people`"
  value       = one(aws_iam_role.person[*].arn)
}
