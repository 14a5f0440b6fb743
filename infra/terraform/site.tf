# The studio's static page (`cargo xtask site`): a private bucket of its own, and CloudFront, which alone may read it.

locals {
  # [] without a page.
  site_url = [for own in aws_cloudfront_distribution.site[*].domain_name : "https://${coalesce(one(var.site_domain[*].name), own)}/"]

  site_here   = var.site ? 1 : 0
  site_folder = coalesce(var.site_folder, "${path.module}/../../target/site")

  # Every browser that the page supports reads Brotli over TLS. So a file that has a compressed one beside it (`.br`) is
  # stored in that form alone, under its own name.
  site_found  = var.site ? fileset(local.site_folder, "**") : toset([])
  site_plain  = toset([for file in local.site_found : file if !endswith(file, ".br")])
  site_packed = toset([for file in local.site_plain : file if contains(local.site_found, "${file}.br") && !contains(keys(local.site_written), file)])

  # Browsers compile a module while it loads only if its type is right, and refuse scripts of another type (`nosniff`).
  site_types = {
    css  = "text/css; charset=utf-8"
    gif  = "image/gif"
    html = "text/html; charset=utf-8"
    js   = "text/javascript; charset=utf-8"
    json = "application/json"
    png  = "image/png"
    ttf  = "font/ttf"
    wasm = "application/wasm"
    zip  = "application/zip"
  }

  # The policy that the studio's page has itself, for every file, and that no other page may frame it: a page cannot say
  # the latter of itself.
  site_page   = var.site ? file("${local.site_folder}/studio.html") : ""
  site_policy = var.site ? regex("default-src 'none';[^\"]*", local.site_page) : ""
}

resource "aws_s3_bucket" "site" {
  count = local.site_here

  #checkov:skip=CKV_AWS_144:The page is built from the sources
  #checkov:skip=CKV_AWS_145:What is in it is public
  #checkov:skip=CKV_AWS_21:The page is built from the sources
  #checkov:skip=CKV_AWS_18:access_log_bucket is optional
  #checkov:skip=CKV2_AWS_61:Nothing in it ages
  #checkov:skip=CKV2_AWS_62:Nothing acts on its objects
  bucket        = "${var.name}-site-${local.account_id}-${local.region}"
  force_destroy = true
  tags          = local.tags
}

resource "aws_s3_bucket_ownership_controls" "site" {
  count = local.site_here

  bucket = aws_s3_bucket.site[0].bucket

  rule {
    object_ownership = "BucketOwnerEnforced"
  }
}

resource "aws_s3_bucket_public_access_block" "site" {
  count = local.site_here

  bucket                  = aws_s3_bucket.site[0].bucket
  block_public_acls       = true
  block_public_policy     = true
  ignore_public_acls      = true
  restrict_public_buckets = true
}

resource "aws_s3_bucket_server_side_encryption_configuration" "site" {
  count = local.site_here

  bucket = aws_s3_bucket.site[0].bucket

  # A key of yours would have to let CloudFront in, to encrypt what everyone may read.
  rule {
    apply_server_side_encryption_by_default {
      sse_algorithm = "AES256"
    }
  }
}

resource "aws_s3_bucket_logging" "site" {
  count = var.access_log_bucket == null ? 0 : local.site_here

  bucket        = aws_s3_bucket.site[0].bucket
  target_bucket = var.access_log_bucket
  target_prefix = "${var.access_log_prefix}site/"
}

resource "aws_s3_bucket_policy" "site" {
  count = local.site_here

  bucket = aws_s3_bucket.site[0].bucket

  policy = jsonencode({
    Version = "2012-10-17"
    Statement = concat(local.tls_statements["site"], [{
      Sid       = "OneDistributionReads"
      Effect    = "Allow"
      Principal = { Service = "cloudfront.amazonaws.com" }
      Action    = "s3:GetObject"
      Resource  = "${aws_s3_bucket.site[0].arn}/*"
      Condition = { StringEquals = { "AWS:SourceArn" = aws_cloudfront_distribution.site[0].arn } }
    }])
  })

  depends_on = [aws_s3_bucket_public_access_block.site]
}

resource "aws_s3_object" "site" {
  for_each = local.site_plain

  bucket       = aws_s3_bucket.site[0].bucket
  key          = each.key
  content_type = lookup(local.site_types, reverse(split(".", each.key))[0], "application/octet-stream")

  content          = lookup(local.site_written, each.key, null)
  source           = contains(keys(local.site_written), each.key) ? null : "${local.site_folder}/${each.key}${contains(local.site_packed, each.key) ? ".br" : ""}"
  source_hash      = contains(keys(local.site_written), each.key) ? sha256(local.site_written[each.key]) : filesha256("${local.site_folder}/${each.key}")
  content_encoding = contains(local.site_packed, each.key) ? "br" : null

  # The names of the page's files stay from version to version, and its parts fit together in one version only: browsers
  # and CloudFront ask each time whether a file has changed.
  cache_control = endswith(each.key, ".gif") || endswith(each.key, ".png") ? "public, max-age=86400" : "public, no-cache"
}

resource "aws_cloudfront_origin_access_control" "site" {
  count = local.site_here

  name                              = "${local.global_name}-site"
  description                       = "Lets the distribution of ${var.name} read its bucket"
  origin_access_control_origin_type = "s3"
  signing_behavior                  = "always"
  signing_protocol                  = "sigv4"
}

resource "aws_cloudfront_cache_policy" "site" {
  count = local.site_here

  name        = "${local.global_name}-site"
  comment     = "As long as each file's Cache-Control says"
  min_ttl     = 0
  default_ttl = 0
  max_ttl     = 86400

  parameters_in_cache_key_and_forwarded_to_origin {
    enable_accept_encoding_brotli = true
    enable_accept_encoding_gzip   = true

    cookies_config {
      cookie_behavior = "none"
    }
    headers_config {
      header_behavior = "none"
    }
    query_strings_config {
      query_string_behavior = "none"
    }
  }
}

resource "aws_cloudfront_response_headers_policy" "site" {
  count = local.site_here

  #checkov:skip=CKV_AWS_259:Names below the page's domain, and lists of browsers, are for the owner of the domain to decide on
  name    = "${local.global_name}-site"
  comment = "The page's content policy, and what keeps others from framing, sniffing or downgrading it"

  security_headers_config {
    content_security_policy {
      content_security_policy = "${replace(local.site_policy, "connect-src 'self'", local.site_talks_to)}; frame-ancestors 'none'"
      override                = true
    }
    content_type_options {
      override = true
    }
    frame_options {
      frame_option = "DENY"
      override     = true
    }
    referrer_policy {
      referrer_policy = "no-referrer"
      override        = true
    }
    strict_transport_security {
      access_control_max_age_sec = 31536000
      include_subdomains         = false
      override                   = true
    }
  }

  custom_headers_config {
    items {
      header   = "Cross-Origin-Opener-Policy"
      value    = "same-origin"
      override = true
    }
    items {
      header   = "Cross-Origin-Resource-Policy"
      value    = "same-origin"
      override = true
    }
    items {
      header   = "Permissions-Policy"
      value    = "camera=(), geolocation=(), microphone=()"
      override = true
    }
  }
}

resource "aws_cloudfront_distribution" "site" {
  count = local.site_here

  #checkov:skip=CKV_AWS_68:It serves files that everyone may read, by GET alone
  #checkov:skip=CKV_AWS_86:access_log_bucket has what reaches the bucket
  #checkov:skip=CKV_AWS_174:A domain of yours (site_domain) has TLS 1.2; with CloudFront's own domain nobody can choose
  #checkov:skip=CKV_AWS_310:The page is one bucket in one region
  #checkov:skip=CKV_AWS_374:Whom the page serves is not the stack's to say
  #checkov:skip=CKV2_AWS_42:site_domain is optional
  #checkov:skip=CKV2_AWS_46:The origin has an access control
  #checkov:skip=CKV2_AWS_47:There is no program behind it
  enabled             = true
  comment             = "The studio's page of ${var.name}"
  default_root_object = "index.html"
  http_version        = "http2and3"
  is_ipv6_enabled     = true
  price_class         = var.site_price_class
  aliases             = var.site_domain[*].name
  tags                = local.tags

  origin {
    origin_id                = "site"
    domain_name              = "${aws_s3_bucket.site[0].bucket}.s3.${local.region}.${local.dns_suffix}"
    origin_access_control_id = aws_cloudfront_origin_access_control.site[0].id
  }

  default_cache_behavior {
    target_origin_id           = "site"
    viewer_protocol_policy     = "redirect-to-https"
    allowed_methods            = ["GET", "HEAD"]
    cached_methods             = ["GET", "HEAD"]
    compress                   = true
    cache_policy_id            = aws_cloudfront_cache_policy.site[0].id
    response_headers_policy_id = aws_cloudfront_response_headers_policy.site[0].id
  }

  restrictions {
    geo_restriction {
      restriction_type = "none"
    }
  }

  viewer_certificate {
    cloudfront_default_certificate = var.site_domain == null ? true : null
    acm_certificate_arn            = one(var.site_domain[*].certificate_arn)
    minimum_protocol_version       = var.site_domain == null ? null : "TLSv1.2_2021"
    ssl_support_method             = var.site_domain == null ? null : "sni-only"
  }

  lifecycle {
    precondition {
      condition     = !strcontains(local.site_policy, "unsafe-inline") && !strcontains(local.site_policy, "'unsafe-eval'")
      error_message = "The page in site_folder allows scripts or styles that are written into it."
    }
  }
}
