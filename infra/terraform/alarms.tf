# What someone should look at. Each alarm is quiet while nothing happens, and its text names the heading of RUNBOOK.md under
# which stands what to do.

locals {
  # Per function, by heading of the runbook.
  function_alarms = {
    throttles = {
      metric      = "Throttles"
      description = "found no free invocation for a quarter of an hour; events wait, and are given up after event_max_age_s."
      statistic   = "Sum"
      threshold   = { for function in keys(local.functions) : function => var.alarm_thresholds.throttles }
      periods     = 3
      functions   = keys(local.functions)
    }
    near-timeouts = {
      metric      = "Duration"
      description = "came within ${100 - var.alarm_thresholds.duration_percent} % of its timeout."
      statistic   = "Maximum"
      threshold   = { for function, size in local.functions : function => size.timeout_s * 10 * var.alarm_thresholds.duration_percent }
      periods     = 1
      functions   = keys(local.functions)
    }
    old-events = {
      metric      = "AsyncEventAge"
      description = "gets to its events late: the oldest waited for more than ${var.alarm_thresholds.event_age_s} s."
      statistic   = "Maximum"
      threshold   = { for function in keys(local.functions) : function => var.alarm_thresholds.event_age_s * 1000 }
      periods     = 1
      functions   = local.event_functions
    }
    dropped-events = {
      metric      = "AsyncEventsDropped"
      description = "had events given up: too old or too often failed. They are in the failure queue."
      statistic   = "Sum"
      threshold   = { for function in keys(local.functions) : function => var.alarm_thresholds.dropped_events }
      periods     = 1
      functions   = local.event_functions
    }
    undelivered-failures = {
      metric      = "DestinationDeliveryFailures"
      description = "had failed events that could not even be put into the failure queue; the sweep has to find them."
      statistic   = "Sum"
      threshold   = { for function in keys(local.functions) : function => 1 }
      periods     = 1
      functions   = local.event_functions
    }
  }

  alarms = merge([
    for alarm, what in local.function_alarms : {
      for function in what.functions : "${function}-${alarm}" => merge(what, {
        function  = function
        threshold = what.threshold[function]
        heading   = alarm
      })
    }
  ]...)

  queue_alarms = {
    old-failures = {
      queue       = aws_sqs_queue.failures.name
      metric      = "ApproximateAgeOfOldestMessage"
      threshold   = var.alarm_thresholds.failure_age_s
      description = "Failed events have been waiting in ${aws_sqs_queue.failures.name} for more than ${var.alarm_thresholds.failure_age_s} s: the record function does not get them written down."
    }
    dead-letters = {
      queue       = aws_sqs_queue.dead_letters.name
      metric      = "ApproximateNumberOfMessagesVisible"
      threshold   = var.alarm_thresholds.dead_letters
      description = "Events that nothing could handle lie in ${aws_sqs_queue.dead_letters.name}; they are kept for 14 days."
    }
  }

  metric_namespace = "Rayfold/${var.name}"
}

resource "aws_cloudwatch_metric_alarm" "function" {
  for_each = { for alarm, what in local.alarms : alarm => what if var.alarms_enabled }

  alarm_name          = "${var.name}-${each.key}"
  alarm_description   = "The ${each.value.function} function ${each.value.description} What to do: ${var.runbook_url}#${each.value.heading}"
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

# Not each error: Lambda tries an event again, mostly with success, and what it gives up is a dropped event.
resource "aws_cloudwatch_metric_alarm" "error_rate" {
  for_each = { for function, name in local.function_names : function => name if var.alarms_enabled }

  alarm_name          = "${var.name}-${each.key}-error-rate"
  alarm_description   = "The ${each.key} function has failed in at least ${var.alarm_thresholds.error_percent} % of its invocations for a quarter of an hour. Bad scripts do not count: they are recorded in the manifest. What to do: ${var.runbook_url}#error-rate"
  comparison_operator = "GreaterThanOrEqualToThreshold"
  threshold           = var.alarm_thresholds.error_percent
  evaluation_periods  = 3
  datapoints_to_alarm = 3
  treat_missing_data  = "notBreaching"
  alarm_actions       = var.alarm_actions
  ok_actions          = var.alarm_actions
  tags                = local.tags

  metric_query {
    id          = "percent"
    expression  = "100 * errors / invocations"
    label       = "Errors in percent of invocations"
    return_data = true
  }

  dynamic "metric_query" {
    for_each = { errors = "Errors", invocations = "Invocations" }

    content {
      id = metric_query.key

      metric {
        namespace   = "AWS/Lambda"
        metric_name = metric_query.value
        dimensions  = { FunctionName = each.value }
        stat        = "Sum"
        period      = 300
      }
    }
  }
}

# What a function could neither handle nor hand on it logs with `unhandled`: an animation that could not be swept, an event
# that could not be read.
resource "aws_cloudwatch_log_metric_filter" "unhandled" {
  for_each = { for function, name in local.log_group_names : function => name if var.alarms_enabled }

  name           = "${var.name}-${each.key}-unhandled"
  log_group_name = aws_cloudwatch_log_group.this[each.key].name
  pattern        = "{ $.unhandled IS TRUE }"

  metric_transformation {
    namespace = local.metric_namespace
    name      = "${each.key}-unhandled"
    value     = "1"
  }
}

resource "aws_cloudwatch_metric_alarm" "unhandled" {
  for_each = aws_cloudwatch_log_metric_filter.unhandled

  alarm_name          = "${var.name}-${each.key}-unhandled"
  alarm_description   = "The ${each.key} function met something that it could neither handle nor hand on; its log says what. What to do: ${var.runbook_url}#unhandled"
  namespace           = local.metric_namespace
  metric_name         = "${each.key}-unhandled"
  statistic           = "Sum"
  comparison_operator = "GreaterThanOrEqualToThreshold"
  threshold           = var.alarm_thresholds.unhandled
  period              = 300
  evaluation_periods  = 1
  datapoints_to_alarm = 1
  treat_missing_data  = "notBreaching"
  alarm_actions       = var.alarm_actions
  ok_actions          = var.alarm_actions
  tags                = local.tags
}

resource "aws_cloudwatch_metric_alarm" "queue" {
  for_each = { for alarm, what in local.queue_alarms : alarm => what if var.alarms_enabled }

  alarm_name          = "${var.name}-${each.key}"
  alarm_description   = "${each.value.description} What to do: ${var.runbook_url}#${each.key}"
  namespace           = "AWS/SQS"
  metric_name         = each.value.metric
  dimensions          = { QueueName = each.value.queue }
  statistic           = "Maximum"
  comparison_operator = "GreaterThanOrEqualToThreshold"
  threshold           = each.value.threshold
  period              = 300
  evaluation_periods  = 1
  datapoints_to_alarm = 1
  treat_missing_data  = "notBreaching"
  alarm_actions       = var.alarm_actions
  ok_actions          = var.alarm_actions
  tags                = local.tags
}

# No sweep in two of its intervals. The one alarm that takes missing data for trouble: nothing else would tell of a schedule
# that is disabled or gone.
resource "aws_cloudwatch_metric_alarm" "sweep" {
  count = var.alarms_enabled ? 1 : 0

  alarm_name          = "${var.name}-missed-sweeps"
  alarm_description   = "The schedule ${aws_scheduler_schedule.sweep.name} has not woken the sweep for ${2 * var.sweep_minutes} minutes; what lost events left undone stays so. What to do: ${var.runbook_url}#missed-sweeps"
  namespace           = "AWS/Scheduler"
  metric_name         = "InvocationAttemptCount"
  dimensions          = { ScheduleGroup = aws_scheduler_schedule_group.this.name }
  statistic           = "Sum"
  comparison_operator = "LessThanThreshold"
  threshold           = 1
  period              = var.sweep_minutes * 60
  evaluation_periods  = 2
  datapoints_to_alarm = 2
  treat_missing_data  = "breaching"
  alarm_actions       = var.alarm_actions
  ok_actions          = var.alarm_actions
  tags                = local.tags
}
