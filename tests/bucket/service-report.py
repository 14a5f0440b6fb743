"""Calls every operation of S3's service model, with each of its parameters, on a running store; writes a report.

    pip install botocore
    rayfold-bucket --data FOLDER --address 127.0.0.1:9001     # with AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY
    python tests/bucket/service-report.py http://127.0.0.1:9001 > docs/reports/s3-operations.md

A call of an operation that the store does not have must not change anything in the store. Nor may a call with a
parameter that the store refuses. Otherwise the script fails.
"""

import datetime
import sys

import botocore
import botocore.config
import botocore.exceptions
import botocore.session

BUCKET, KEY = "films", "a"
# These operations change the store as intended, so they run on a bucket of their own.
CHANGING = {
    "AbortMultipartUpload", "CompleteMultipartUpload", "CopyObject", "CreateBucket", "CreateMultipartUpload",
    "DeleteBucket", "DeleteBucketCors", "DeleteObject", "DeleteObjects", "PutBucketAcl", "PutBucketCors",
    "PutBucketNotification", "PutBucketNotificationConfiguration", "PutObject", "PutObjectAcl", "UploadPart",
    "UploadPartCopy",
}


def client(endpoint):
    config = botocore.config.Config(
        parameter_validation=False,
        retries={"total_max_attempts": 1},
        s3={"addressing_style": "path"},
        disable_request_compression=True,
        inject_host_prefix=False,
    )
    session = botocore.session.get_session()
    return session.create_client("s3", region_name="us-east-1", endpoint_url=endpoint, config=config)


def value(shape, depth=0):
    """A value of a shape, with what is required inside it."""
    kind = shape.type_name
    if kind == "structure":
        wanted = shape.required_members or (list(shape.members)[:1] if depth < 4 else [])
        return {name: value(shape.members[name], depth + 1) for name in wanted}
    if kind == "list":
        return [value(shape.member, depth + 1)]
    if kind == "map":
        return {"k": "v"}
    if kind == "boolean":
        return True
    if kind in ("integer", "long"):
        return 1
    if kind == "timestamp":
        return datetime.datetime(2033, 5, 18)
    if kind == "blob":
        return b"note"
    return shape.enum[0] if getattr(shape, "enum", None) else "x"


def state(s3):
    """All that is in the store."""
    contents = []
    for bucket in s3.list_buckets()["Buckets"]:
        name = bucket["Name"]
        contents.append((name, bucket["CreationDate"]))
        for item in s3.list_objects_v2(Bucket=name).get("Contents", []):
            got = s3.get_object(Bucket=name, Key=item["Key"])
            contents.append((item["Key"], item["ETag"], item["LastModified"], got["Body"].read(), got["Metadata"]))
        contents.append(repr(s3.list_multipart_uploads(Bucket=name).get("Uploads")))
        contents.append(repr(s3.get_bucket_notification_configuration(Bucket=name).get("QueueConfigurations")))
        try:
            contents.append(repr(s3.get_bucket_cors(Bucket=name)["CORSRules"]))
        except botocore.exceptions.ClientError:
            contents.append("no rules")
    return contents


def call(s3, name, arguments):
    """S3's code, or the status of a success."""
    method = getattr(s3, botocore.xform_name(name))
    try:
        return str(method(**arguments)["ResponseMetadata"]["HTTPStatusCode"])
    except botocore.exceptions.ClientError as error:
        # A HEAD has no body for a code.
        code = error.response["Error"]["Code"]
        return "NotImplemented" if code == "501" else code
    except Exception as error:  # The client refuses the call itself.
        return f"not sent ({type(error).__name__})"


def main():
    s3 = client(sys.argv[1])
    s3.create_bucket(Bucket=BUCKET)
    s3.put_object(Bucket=BUCKET, Key=KEY, Body=b"precious")
    before = state(s3)
    rows, refused, changed = [], 0, []
    for name in s3.meta.service_model.operation_names:
        shape = s3.meta.service_model.operation_model(name).input_shape
        members = shape.members if shape else {}
        base = {m: value(members[m]) for m in (shape.required_members if shape else [])}
        for member, given in (("Bucket", BUCKET), ("Key", KEY), ("CopySource", f"{BUCKET}/{KEY}")):
            if member in members:
                base[member] = given
        if name in CHANGING:
            base["Bucket"] = "scratch"
            s3.create_bucket(Bucket="scratch")
            s3.put_object(Bucket="scratch", Key=KEY, Body=b"scratch")
        answer = call(s3, name, base)
        not_there, others = [], {}
        for member in members:
            # A length that is not the body's breaks the connection, not the request.
            if member in base or member == "ContentLength" or answer == "NotImplemented":
                continue
            got = call(s3, name, base | {member: value(members[member])})
            if got in ("NotImplemented", "AccessControlListNotSupported"):
                not_there.append(member)
            elif got != answer:
                others.setdefault(got, []).append(member)
        if name in CHANGING and "scratch" in [b["Name"] for b in s3.list_buckets()["Buckets"]]:
            for upload in s3.list_multipart_uploads(Bucket="scratch").get("Uploads", []):
                s3.abort_multipart_upload(Bucket="scratch", Key=upload["Key"], UploadId=upload["UploadId"])
            for item in s3.list_objects_v2(Bucket="scratch").get("Contents", []):
                s3.delete_object(Bucket="scratch", Key=item["Key"])
            s3.delete_bucket(Bucket="scratch")
        if state(s3) != before:
            changed.append(name)
            before = state(s3)
        refused += answer == "NotImplemented"
        rows.append((name, answer, " ".join(not_there), "; ".join(f"{k}: {' '.join(v)}" for k, v in others.items())))
    print("# S3's operations, one by one\n")
    print(f"botocore {botocore.__version__} calls every operation of its S3 service model on the store. The first")
    print("call has the required parameters alone. If the store has the operation, each further call has one other")
    print("parameter in addition. *Answer* is the HTTP status or the S3 error code of the first call. *Refused*")
    print("lists the parameters that the store rejects as not implemented (`NotImplemented`, or")
    print("`AccessControlListNotSupported`). *Other answers* are caused by values that this script makes up. After")
    print("each operation the script compares all buckets, objects, their bodies and times, uploads and rules with")
    print("those before. Operations that are meant to change the store run on a bucket of their own.\n")
    print(f"{refused} of {len(rows)} operations are refused entirely. Operations with an unintended change: "
          f"{', '.join(changed) or 'none'}.\n")
    print("Written by `tests/bucket/service-report.py`. `cargo test` sends the same operations as raw requests")
    print("(`tests/bucket/model.rs`).\n")
    print("| operation | answer | refused | other answers |\n| --- | --- | --- | --- |")
    for row in rows:
        print("| " + " | ".join(row) + " |")
    sys.exit(1 if changed else 0)


main()
