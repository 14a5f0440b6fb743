# One page that answers: is it working, is it slow, is something stuck?

locals {
  # Partitions have consoles of their own.
  console = lookup({
    aws-cn     = "console.amazonaws.cn"
    aws-us-gov = "console.amazonaws-us-gov.com"
  }, local.partition, "console.aws.amazon.com")

  # What each graph shows of the functions, in reading order.
  graphs = [
    { title = "Invocations", metric = "Invocations", stat = "Sum" },
    { title = "Errors and throttles", metric = "Errors", stat = "Sum", also = "Throttles" },
    { title = "Duration, longest (ms)", metric = "Duration", stat = "Maximum" },
    { title = "Duration, median (ms)", metric = "Duration", stat = "p50" },
    { title = "Invocations at once", metric = "ConcurrentExecutions", stat = "Maximum" },
    { title = "Age of the oldest event (ms)", metric = "AsyncEventAge", stat = "Maximum" },
  ]

  graph_widgets = [
    for index, graph in local.graphs : {
      type   = "metric"
      x      = (index % 3) * 8
      y      = floor(index / 3) * 6
      width  = 8
      height = 6
      properties = {
        title  = graph.title
        view   = "timeSeries"
        region = local.region
        stat   = graph.stat
        period = 60
        metrics = [
          for pair in setproduct(compact([graph.metric, lookup(graph, "also", "")]), values(local.function_names)) :
          ["AWS/Lambda", pair[0], "FunctionName", pair[1], { label = "${pair[1]} ${pair[0]}" }]
        ]
      }
    }
  ]

  queue_widget = {
    type   = "metric"
    x      = 0
    y      = 12
    width  = 8
    height = 6
    properties = {
      title  = "Failed events waiting"
      view   = "timeSeries"
      region = local.region
      stat   = "Maximum"
      period = 60
      metrics = [
        for queue in [aws_sqs_queue.failures.name, aws_sqs_queue.dead_letters.name] :
        ["AWS/SQS", "ApproximateNumberOfMessagesVisible", "QueueName", queue, { label = queue }]
      ]
    }
  }

  log_widget = {
    type   = "log"
    x      = 8
    y      = 12
    width  = 16
    height = 6
    properties = {
      title  = "Latest warnings and errors"
      view   = "table"
      region = local.region
      query = join(" | ", concat(
        [for name in values(local.log_group_names) : "SOURCE '${name}'"],
        # Of a timeout or a lack of memory only the platform tells.
        ["filter level in ['WARN', 'ERROR'] or record.status in ['error', 'failure', 'timeout']", "sort @timestamp desc", "limit 50"],
      ))
    }
  }
}

resource "aws_cloudwatch_dashboard" "this" {
  count = var.dashboard_enabled ? 1 : 0

  dashboard_name = local.global_name
  dashboard_body = jsonencode({ widgets = concat(local.graph_widgets, [local.queue_widget, local.log_widget]) })
}
