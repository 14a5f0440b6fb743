# The schedule of the sweep, which finds what lost events left undone.

resource "aws_scheduler_schedule_group" "this" {
  name = var.name
  tags = local.tags
}

resource "aws_scheduler_schedule" "sweep" {
  #checkov:skip=CKV_AWS_297:The schedule holds nothing of anybody's data
  name                = "${var.name}-sweep"
  description         = "Heals what lost events left undone"
  group_name          = aws_scheduler_schedule_group.this.name
  schedule_expression = "rate(${var.sweep_minutes} minutes)"

  flexible_time_window {
    mode = "OFF"
  }

  target {
    arn      = aws_lambda_function.this["assemble"].arn
    role_arn = aws_iam_role.scheduler.arn
    input    = jsonencode({ sweep = true })

    # The next sweep does all that this one would have done.
    retry_policy {
      maximum_event_age_in_seconds = max(60, (var.sweep_minutes - 1) * 60)
      maximum_retry_attempts       = 2
    }

    dead_letter_config {
      arn = aws_sqs_queue.dead_letters.arn
    }
  }

  # The scheduler checks at once that its role lets it in.
  depends_on = [aws_iam_role_policy.scheduler]
}
