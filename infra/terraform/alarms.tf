# What someone should look at. Each alarm is quiet while nothing happens.

locals {
  # Per function: what, how much of it, over how long.
  function_alarms = {
    errors = {
      metric      = "Errors"
      description = "failed, timed out or ran out of memory. Bad scripts do not count: they are recorded in the manifest."
      statistic   = "Sum"
      threshold   = { for function in keys(local.functions) : function => 1 }
      periods     = 1
    }
    throttles = {
      metric      = "Throttles"
      description = "found no free invocation for a quarter of an hour; events wait, and are given up after event_max_age_s."
      statistic   = "Sum"
      threshold   = { for function in keys(local.functions) : function => 1 }
      periods     = 3
    }
    near-timeouts = {
      metric      = "Duration"
      description = "came within a tenth of its timeout."
      statistic   = "Maximum"
      threshold   = { for function, size in local.functions : function => size.timeout_s * 1000 * 0.9 }
      periods     = 1
    }
    dropped-events = {
      metric      = "AsyncEventsDropped"
      description = "had events given up: too old or too often failed. They are in the failure queue."
      statistic   = "Sum"
      threshold   = { for function in keys(local.functions) : function => 1 }
      periods     = 1
    }
    undelivered-failures = {
      metric      = "DestinationDeliveryFailures"
      description = "had failed events that could not even be put into the failure queue; the sweep has to find them."
      statistic   = "Sum"
      threshold   = { for function in keys(local.functions) : function => 1 }
      periods     = 1
    }
  }

  alarms = merge([
    for function in keys(local.functions) : {
      for alarm, what in local.function_alarms : "${function}-${alarm}" => merge(what, {
        function  = function
        threshold = what.threshold[function]
      })
    }
  ]...)
}

resource "aws_cloudwatch_metric_alarm" "function" {
  for_each = { for alarm, what in local.alarms : alarm => what if var.alarms_enabled }

  alarm_name          = "${var.name}-${each.key}"
  alarm_description   = "The ${each.value.function} function ${each.value.description}"
  namespace           = "AWS/Lambda"
  metric_name         = each.value.metric
  dimensions          = { FunctionName = local.function_names[each.value.function] }
  statistic           = each.value.statistic
  comparison_operator = "GreaterThanOrEqualToThreshold"
  threshold           = each.value.threshold
  period              = 300
  evaluation_periods  = each.value.periods
  datapoints_to_alarm = each.value.periods
  treat_missing_data  = "notBreaching"
  alarm_actions       = var.alarm_actions
  ok_actions          = var.alarm_actions
  tags                = local.tags
}

resource "aws_cloudwatch_metric_alarm" "dead_letters" {
  count = var.alarms_enabled ? 1 : 0

  alarm_name          = "${var.name}-dead-letters"
  alarm_description   = "Events that nothing could handle lie in ${aws_sqs_queue.dead_letters.name}; they are kept for 14 days."
  namespace           = "AWS/SQS"
  metric_name         = "ApproximateNumberOfMessagesVisible"
  dimensions          = { QueueName = aws_sqs_queue.dead_letters.name }
  statistic           = "Maximum"
  comparison_operator = "GreaterThanOrEqualToThreshold"
  threshold           = 1
  period              = 300
  evaluation_periods  = 1
  datapoints_to_alarm = 1
  treat_missing_data  = "notBreaching"
  alarm_actions       = var.alarm_actions
  ok_actions          = var.alarm_actions
  tags                = local.tags
}
