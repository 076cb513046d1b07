"""Which kernels a model runs on, and that edited code is never one of them."""

import pytest

from wheelpend import Model
from wheelpend.model import model_kernels


def test_the_kernels_of_the_library_do_not_change_when_an_effect_is_added():
    model = Model.default()
    assert model_kernels.library_module_of(model) is model_kernels.library_module_of(
        model.with_effects(["coulomb_drive", "cogging"])
    )


def test_a_workspaces_edited_code_is_never_executed(tmp_path):
    from wheelpend import Failure
    from wheelpend.model import workspace

    model = workspace.create(tmp_path)
    code = tmp_path / "generated" / "wheel_pendulum.py"
    code.write_text("raise SystemExit('executed')\n")
    with pytest.raises(Failure, match="wheelpend generate"):
        model_kernels.load_kernels(tmp_path)
    workspace.generate(model)
    assert model_kernels.load_kernels(tmp_path).ROWS == ("wheel", "body")
