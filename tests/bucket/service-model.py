"""Writes the operations of S3's service model, with their parameters, as a table that the test `model` reads.

    pip install botocore
    python tests/bucket/service-model.py > tests/bucket/service-model.txt
"""

import botocore
import botocore.session

MODEL = botocore.session.get_session().get_service_model("s3")


def elements(shape, path=()):
    """Yields the path of every element below a shape, without its own name."""
    if shape.type_name != "structure":
        return
    for name, member in shape.members.items():
        inside = path + (member.serialization.get("name", name),)
        while member.type_name == "list":
            item = member.member
            if not member.serialization.get("flattened"):
                inside += (item.serialization.get("name", "member"),)
            member = item
        if member.serialization.get("xmlAttribute"):
            continue
        yield inside
        yield from elements(member, inside)


def main():
    print(f"# S3's operations and their parameters, of botocore {botocore.__version__}: see service-model.py.")
    for name in MODEL.operation_names:
        operation = MODEL.operation_model(name)
        shape = operation.input_shape
        print(name, operation.http["method"], operation.http["requestUri"])
        if shape is None:
            continue
        if operation.http_checksum.get("requestChecksumRequired"):
            print("  digest")
        payload = shape.serialization.get("payload")
        for member, value in shape.members.items():
            place = value.serialization.get("location")
            kind = {"querystring": "query", "header": "header", "headers": "headers"}.get(place)
            if kind:
                required = " required" if member in shape.required_members else ""
                print(f"  {kind} {value.serialization['name']}{required}")
            elif member == payload and value.type_name == "structure":
                print(f"  root {value.serialization.get('name', value.name)}")
                for path in elements(value):
                    print(f"  element {'/'.join(path)}")
            elif member == payload:
                print("  bytes")


main()
