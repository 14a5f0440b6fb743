output "bucket" {
  description = "Name of the bucket"
  value       = module.rayfold.bucket
}

output "sync_command" {
  description = "Uploads a folder"
  value       = module.rayfold.sync_command
}

output "submit_command" {
  description = "Uploads a folder, waits, and downloads the animation"
  value       = module.rayfold.submit_command
}

output "dashboard_url" {
  description = "Address of the dashboard"
  value       = module.rayfold.dashboard_url
}

output "alarm_topic_arn" {
  description = "ARN of the topic that tells of alarms"
  value       = aws_sns_topic.alarms.arn
}

output "user_policy_arns" {
  description = "ARNs of the policies for people, by `viewer`, `uploader` and `operator`"
  value       = { for user, policy in aws_iam_policy.user : user => policy.arn }
}

output "site_url" {
  description = "Address of the studio's page"
  value       = module.rayfold.site_url
}
