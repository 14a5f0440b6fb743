output "people" {
  description = "The stack's input `people`"
  value = {
    identity_pool_id = aws_cognito_identity_pool.this.id
    user_pool_id     = aws_cognito_user_pool.this.id
    client_id        = aws_cognito_user_pool_client.page.id
  }
}

output "invite_command" {
  description = "Invites a person, who gets a temporary password by mail"
  value       = "aws cognito-idp admin-create-user --region ${local.region} --user-pool-id ${aws_cognito_user_pool.this.id} --username EMAIL"
}
