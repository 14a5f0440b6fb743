# The studio's page: off by default, private, and served by CloudFront alone.

mock_provider "aws" {
  source = "./tests/mocks"
}

variables {
  name        = "demo"
  site        = true
  site_folder = "tests/site"
  packages = {
    render   = "tests/packages/rayfold-render.zip"
    assemble = "tests/packages/rayfold-assemble.zip"
  }
}

run "off" {
  variables {
    site        = false
    site_folder = null
  }

  assert {
    condition = 0 == sum([
      length(aws_s3_bucket.site), length(aws_s3_object.site), length(aws_cloudfront_distribution.site),
      length(aws_iam_role.person), length(aws_s3_bucket_cors_configuration.this),
    ])
    error_message = "nothing of the page may exist by default"
  }
  assert {
    condition     = output.site_url == null && output.site_bucket == null && output.site_domain_name == null && output.person_role_arn == null
    error_message = "the outputs may name no page by default"
  }
}

run "bucket" {
  assert {
    condition     = output.site_bucket == "demo-site-123456789012-eu-central-1"
    error_message = output.site_bucket
  }
  assert {
    condition = alltrue([
      aws_s3_bucket_public_access_block.site[0].block_public_acls,
      aws_s3_bucket_public_access_block.site[0].block_public_policy,
      aws_s3_bucket_public_access_block.site[0].ignore_public_acls,
      aws_s3_bucket_public_access_block.site[0].restrict_public_buckets,
      aws_s3_bucket_ownership_controls.site[0].rule[0].object_ownership == "BucketOwnerEnforced",
    ])
    error_message = "the page's bucket may not be public"
  }
  assert {
    condition = jsondecode(aws_s3_bucket_policy.site[0].policy) == jsondecode(jsonencode({
      Version = "2012-10-17"
      Statement = [
        {
          Sid       = "TlsOnly"
          Effect    = "Deny"
          Principal = "*"
          Action    = "s3:*"
          Resource  = ["arn:aws:s3:::demo-site-123456789012-eu-central-1", "arn:aws:s3:::demo-site-123456789012-eu-central-1/*"]
          Condition = { Bool = { "aws:SecureTransport" = "false" } }
        },
        {
          Sid       = "Tls12OrNewer"
          Effect    = "Deny"
          Principal = "*"
          Action    = "s3:*"
          Resource  = ["arn:aws:s3:::demo-site-123456789012-eu-central-1", "arn:aws:s3:::demo-site-123456789012-eu-central-1/*"]
          Condition = { NumericLessThan = { "s3:TlsVersion" = "1.2" } }
        },
        {
          Sid       = "OneDistributionReads"
          Effect    = "Allow"
          Principal = { Service = "cloudfront.amazonaws.com" }
          Action    = "s3:GetObject"
          Resource  = "arn:aws:s3:::demo-site-123456789012-eu-central-1/*"
          Condition = { StringEquals = { "AWS:SourceArn" = "arn:aws:cloudfront::123456789012:distribution/EDFDVBD6EXAMPLE" } }
        },
      ]
    }))
    error_message = "one distribution reads objects by TLS, and nobody else reads anything"
  }
}

run "files" {
  assert {
    condition = { for file, object in aws_s3_object.site : file => object.content_type } == {
      "examples/hello.gif" = "image/gif"
      "examples/hello.zip" = "application/zip"
      "font.ttf"           = "font/ttf"
      "index.html"         = "text/html; charset=utf-8"
      "offline.js"         = "text/javascript; charset=utf-8"
      "rayfold.json"       = "application/json"
      "relaxed.wasm"       = "application/wasm"
      "studio.css"         = "text/css; charset=utf-8"
      "studio.html"        = "text/html; charset=utf-8"
      "studio.js"          = "text/javascript; charset=utf-8"
    }
    error_message = "each file must be there with its type, and none of those with the ending .br"
  }
  assert {
    condition = alltrue([for file, object in aws_s3_object.site : (
      fileexists("tests/site/${file}.br")
      ? object.content_encoding == "br" && object.source == "tests/site/${file}.br"
      : object.content_encoding == null && object.source == "tests/site/${file}"
    )])
    error_message = "what Brotli has compressed must be sent so, and nothing else"
  }
  assert {
    condition     = alltrue([for file, object in aws_s3_object.site : object.cache_control == (endswith(file, ".gif") ? "public, max-age=86400" : "public, no-cache")])
    error_message = "parts of different versions of the page must not meet in a browser"
  }
}

run "distribution" {
  assert {
    condition = alltrue([
      one(aws_cloudfront_distribution.site[0].origin).domain_name == "demo-site-123456789012-eu-central-1.s3.eu-central-1.amazonaws.com",
      one(aws_cloudfront_distribution.site[0].origin).origin_access_control_id == "access",
      aws_cloudfront_origin_access_control.site[0].signing_behavior == "always",
      aws_cloudfront_distribution.site[0].default_cache_behavior[0].viewer_protocol_policy == "redirect-to-https",
      aws_cloudfront_distribution.site[0].default_cache_behavior[0].allowed_methods == toset(["GET", "HEAD"]),
      aws_cloudfront_distribution.site[0].default_cache_behavior[0].response_headers_policy_id == "headers",
      aws_cloudfront_distribution.site[0].viewer_certificate[0].cloudfront_default_certificate,
      aws_cloudfront_distribution.site[0].default_root_object == "index.html",
    ])
    error_message = "CloudFront must sign its requests, and be read by TLS alone"
  }
  assert {
    condition     = aws_cloudfront_response_headers_policy.site[0].security_headers_config[0].content_security_policy[0].content_security_policy == "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; base-uri 'none'; frame-ancestors 'none'"
    error_message = "the header must have the page's own policy"
  }
  assert {
    condition = alltrue([
      aws_cloudfront_response_headers_policy.site[0].security_headers_config[0].strict_transport_security[0].access_control_max_age_sec == 31536000,
      aws_cloudfront_response_headers_policy.site[0].security_headers_config[0].content_type_options[0].override,
      aws_cloudfront_response_headers_policy.site[0].security_headers_config[0].frame_options[0].frame_option == "DENY",
      aws_cloudfront_response_headers_policy.site[0].security_headers_config[0].referrer_policy[0].referrer_policy == "no-referrer",
    ])
    error_message = "the security headers must be sent"
  }
  assert {
    condition     = output.site_url == "https://d111111abcdef8.cloudfront.net/" && output.site_domain_name == "d111111abcdef8.cloudfront.net"
    error_message = output.site_url
  }
}

run "domain" {
  variables {
    site_domain = {
      name            = "studio.example.com"
      certificate_arn = "arn:aws:acm:us-east-1:123456789012:certificate/11111111-2222-3333-4444-555555555555"
    }
  }

  assert {
    condition = alltrue([
      aws_cloudfront_distribution.site[0].aliases == toset(["studio.example.com"]),
      aws_cloudfront_distribution.site[0].viewer_certificate[0].acm_certificate_arn == var.site_domain.certificate_arn,
      aws_cloudfront_distribution.site[0].viewer_certificate[0].minimum_protocol_version == "TLSv1.2_2021",
      aws_cloudfront_distribution.site[0].viewer_certificate[0].ssl_support_method == "sni-only",
      output.site_url == "https://studio.example.com/",
    ])
    error_message = "a domain of one's own must have TLS 1.2 and its certificate"
  }
}

run "domain_with_a_certificate_of_another_region" {
  command = plan
  variables {
    site_domain = {
      name            = "studio.example.com"
      certificate_arn = "arn:aws:acm:eu-central-1:123456789012:certificate/11111111-2222-3333-4444-555555555555"
    }
  }
  expect_failures = [var.site_domain]
}

run "longest_names_fit" {
  variables {
    name = "a-name-of-thirty-characters-12"
  }

  override_data {
    target = data.aws_region.current
    values = { region = "ap-southeast-2" }
  }

  assert {
    condition     = length(aws_s3_bucket.site[0].bucket) <= 63
    error_message = "a bucket's name has at most 63 characters"
  }
}

run "name_too_long_for_the_page" {
  command = plan
  variables {
    name = "a-name-of-thirty-characters-123"
  }
  expect_failures = [var.site]
}

run "price_class_unknown" {
  command = plan
  variables {
    site_price_class = "PriceClass_300"
  }
  expect_failures = [var.site_price_class]
}

run "page_missing" {
  command = plan
  variables {
    site_folder = "tests/packages"
  }
  expect_failures = [var.site_folder]
}

run "page_with_scripts_in_it" {
  command = plan
  variables {
    site_folder = "tests/site-unsafe"
  }
  expect_failures = [aws_cloudfront_distribution.site]
}

run "access_log" {
  variables {
    access_log_bucket = "logs"
  }

  assert {
    condition     = aws_s3_bucket_logging.site[0].target_bucket == "logs" && aws_s3_bucket_logging.site[0].target_prefix == "rayfold/site/"
    error_message = "the page's requests must be logged where the others are"
  }
}

run "budget" {
  variables {
    budget = { monthly_usd = 50, emails = ["a@example.com"] }
  }

  assert {
    condition     = contains([for filter in aws_budgets_budget.this[0].cost_filter : filter.values if filter.name == "Region"], tolist(["eu-central-1", "global"]))
    error_message = "CloudFront, which has no region, must count"
  }
}

run "beside_an_existing_bucket" {
  variables {
    existing_bucket = "films"
  }

  assert {
    condition     = length(jsondecode(aws_s3_bucket_policy.site[0].policy).Statement) == 3 && length(aws_s3_bucket_policy.this) == 0
    error_message = "the page's bucket is the stack's own in any case"
  }
}
