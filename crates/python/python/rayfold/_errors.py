"""What goes wrong with scripts: errors and warnings that hold diagnostics."""

MOST = 20


class SceneError(ValueError):
    """A script has errors: `diagnostics` lists them all."""

    def __init__(self, diagnostics):
        self.diagnostics = list(diagnostics)
        errors = [d for d in self.diagnostics if d.severity == "error"]
        text = "\n".join(str(d) for d in errors[:MOST])
        if len(errors) > MOST:
            text += f"\nand {len(errors) - MOST} more errors"
        super().__init__(text)


class SceneWarning(UserWarning):
    """A script is drawn, but perhaps not as intended."""
