# A check before anything is destroyed. S3 refuses to delete a bucket that holds objects, but Terraform deletes the bucket
# last: the data would be left behind without versioning, public access block, TLS policy and lifecycle, and without the
# functions.

resource "terraform_data" "bucket_must_be_empty" {
  count = local.made_here

  # The provisioner below sees these, as they were at the last apply.
  input = {
    bucket        = local.bucket
    force_destroy = tostring(var.force_destroy)
    region        = local.region
  }

  # Another name of the bucket or of the stack replaces the bucket: destroyed first, this checks the old one.
  triggers_replace = [local.bucket, var.name]

  # Fails if the bucket holds an object or an old version of one. Where the AWS CLI is missing, or may not list the bucket,
  # it says so and lets Terraform go on.
  provisioner "local-exec" {
    when        = destroy
    interpreter = ["/bin/sh", "-c"]
    environment = {
      BUCKET        = self.input.bucket
      FORCE_DESTROY = self.input.force_destroy
      REGION        = self.input.region
    }
    command = <<-CHECK
      [ "$FORCE_DESTROY" != true ] || exit 0
      found=$(aws s3api list-object-versions --bucket "$BUCKET" --region "$REGION" --max-items 1 \
        --query '[Versions, DeleteMarkers][][].Key | [0]' --output text 2>&1) || {
        case $found in
          *NoSuchBucket*) exit 0 ;;
        esac
        echo "rayfold: cannot tell whether $BUCKET is empty ($found). If it is not, S3 refuses to delete it, and its settings are lost: restore them with terraform apply." >&2
        exit 0
      }
      found=$(printf '%s\n' "$found" | head -n 1)
      [ "$found" = None ] && exit 0
      echo "rayfold: the bucket $BUCKET holds objects or old versions, such as $found. Nothing was destroyed. Empty the bucket first, or apply force_destroy = true to delete the objects with it." >&2
      exit 1
    CHECK
  }

  # Destroyed before everything that these name, which is all of the stack: `check` compares.
  depends_on = [
    aws_budgets_budget.this,
    aws_cloudfront_cache_policy.site,
    aws_cloudfront_distribution.site,
    aws_cloudfront_origin_access_control.site,
    aws_cloudfront_response_headers_policy.site,
    aws_cloudwatch_dashboard.this,
    aws_cloudwatch_log_metric_filter.unhandled,
    aws_cloudwatch_metric_alarm.error_rate,
    aws_cloudwatch_metric_alarm.function,
    aws_cloudwatch_metric_alarm.queue,
    aws_cloudwatch_metric_alarm.sweep,
    aws_cloudwatch_metric_alarm.unhandled,
    aws_iam_role_policy.objects,
    aws_iam_role_policy.person,
    aws_iam_role_policy.platform,
    aws_iam_role_policy.scheduler,
    aws_lambda_event_source_mapping.failures,
    aws_lambda_function_event_invoke_config.this,
    aws_lambda_function_recursion_config.this,
    aws_lambda_permission.bucket,
    aws_s3_bucket_cors_configuration.this,
    aws_s3_bucket_lifecycle_configuration.this,
    aws_s3_bucket_logging.site,
    aws_s3_bucket_logging.this,
    aws_s3_bucket_notification.this,
    aws_s3_bucket_ownership_controls.site,
    aws_s3_bucket_ownership_controls.this,
    aws_s3_bucket_policy.site,
    aws_s3_bucket_policy.this,
    aws_s3_bucket_public_access_block.site,
    aws_s3_bucket_public_access_block.this,
    aws_s3_bucket_server_side_encryption_configuration.site,
    aws_s3_bucket_server_side_encryption_configuration.this,
    aws_s3_bucket_versioning.this,
    aws_s3_object.site,
    aws_scheduler_schedule.sweep,
    aws_sqs_queue_policy.tls_only,
    aws_sqs_queue_redrive_allow_policy.dead_letters,
  ]
}
