output "sync_command" {
  description = "Uploads a folder"
  value       = module.rayfold.sync_command
}

output "submit_command" {
  description = "Uploads a folder, waits, and downloads the animation"
  value       = module.rayfold.submit_command
}
