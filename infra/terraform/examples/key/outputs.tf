output "kms_key_arn" {
  description = "ARN of the key, for kms_key_arn"
  value       = aws_kms_key.objects.arn
}
