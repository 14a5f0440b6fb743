# What the stack may cost in a month before the recipients get a message. It reports; it stops nothing.

resource "aws_budgets_budget" "this" {
  count = var.budget == null ? 0 : 1

  # Budgets are the account's, not the region's.
  name         = local.global_name
  budget_type  = "COST"
  time_unit    = "MONTHLY"
  limit_amount = tostring(var.budget.monthly_usd)
  limit_unit   = "USD"
  tags         = local.tags

  # Empty until the account's owner activates the tag for cost allocation.
  cost_filter {
    name   = "TagKeyValue"
    values = [format("user:Application$%s", local.tags.Application)]
  }

  # Another region may have a stack of the same name, with a budget of its own. CloudFront is of no region.
  cost_filter {
    name   = "Region"
    values = concat([local.region], var.site ? ["global"] : [])
  }

  dynamic "notification" {
    for_each = { ACTUAL = 80, FORECASTED = 100 }

    content {
      notification_type          = notification.key
      comparison_operator        = "GREATER_THAN"
      threshold                  = notification.value
      threshold_type             = "PERCENTAGE"
      subscriber_email_addresses = var.budget.emails
      subscriber_sns_topic_arns  = var.budget.topic_arns
    }
  }
}
