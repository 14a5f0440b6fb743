output "site_url" {
  description = "Address of the page"
  value       = module.rayfold.site_url
}

output "invite_command" {
  description = "Invites a person"
  value       = module.sign_in.invite_command
}
