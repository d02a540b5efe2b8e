"""Where the published recordings come from: repository, commit, path and SHA-256 of every file that is read here."""

from typing import NamedTuple


class Source(NamedTuple):
    """One machine's published files.

    Attributes:
        repository: On GitHub, owner/name.
        commit: The commit the files were taken from.
        licence: Of the data.
        files: Name in the local folder -> (path in the repository, SHA-256).
    """

    repository: str
    commit: str
    licence: str
    files: dict[str, tuple[str, str]]

    def url(self, name: str) -> str:
        """Address of a file at the pinned commit."""
        return f"https://raw.githubusercontent.com/{self.repository}/{self.commit}/{self.files[name][0]}"


SOURCES = {
    "staubli_tx40": Source(
        "thanhndv212/figaroh-plus", "c3b5172849b744984b7181fd9d517c83fb4242e1", "Apache-2.0",
        {
            "pos_read_data.csv": (
                "examples/staubli_TX40/data/pos_read_data.csv",
                "5cc1cecc1024ef0e331d0caba06f689456ab789ec3f1e904599c0a8be5c27bc8",
            ),
            "curr_data.csv": (
                "examples/staubli_TX40/data/curr_data.csv",
                "f4592f4ba4db42f5d7625688986be25b575ca34d0504b27979ca6b0276bd3af9",
            ),
            "tx40_mdh_modified.urdf": (
                "models/staubli_tx40_description/urdf/tx40_mdh_modified.urdf",
                "3d00cbd46279c915d594b1bb4610dbac78d1e99ed27f95de70984bde13486074",
            ),
        },
    ),
    "dfki_double_pendulum": Source(
        "dfki-ric-underactuated-lab/double_pendulum", "1e8544e67f3da72a51ee52fbbb278e131ce2a43f", "BSD-3-Clause",
        {
            "design_C.1/20230629-143339.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-143339/trajectory.csv",
                "94f17287b53187dfe8f4ce131f4e7c49918309fcc915cbae2f64ed3101e7c23b",
            ),
            "design_C.1/20230629-143524.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-143524/trajectory.csv",
                "03fc5e18915e80afabb3e2674b627f9d849d43675aeacbf586ccd24b3ebd7ca5",
            ),
            "design_C.1/20230629-143601.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-143601/trajectory.csv",
                "e028c1d7a6a45cfe1b96b7cb33aae412b8888f022677d392f6f9cd4d4f63886d",
            ),
            "design_C.1/20230629-143704.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-143704/trajectory.csv",
                "e19682394cb7dc8847db9010e568b139a85a447bfbc4547b8828ad58da64a2a9",
            ),
            "design_C.1/20230629-143747.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-143747/trajectory.csv",
                "8b3f8f25dceec77dbe05c2e687d86485b272fbcabd3af5485a119c9944243a1e",
            ),
            "design_C.1/20230629-143906.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-143906/trajectory.csv",
                "45c7ed0eb4811ee0b11650b6ae344222bfcf4f7a313c7da611442149ee91e70c",
            ),
            "design_C.1/20230629-144003.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-144003/trajectory.csv",
                "6841154d567f064208961b2829907fc8457dfd857472286627a0e84da8ab36ed",
            ),
            "design_C.1/20230629-144115.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-144115/trajectory.csv",
                "c7ec2483e9dd10bfd536e5797002f39af56933ff697da1082aaf28012cda14ed",
            ),
            "design_C.1/20230629-154220.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-154220/trajectory.csv",
                "c14a6334d98e6c86883cc3a84d41f41d25aab7d5d7a30e4690c0024a20e8972a",
            ),
            "design_C.1/20230629-154548.csv": (
                "data/experiment_records/design_C.1/sys_id/20230629/20230629-154548/trajectory.csv",
                "0af9a5f9ef4442a0bd5004cebdaf0eec12c10c01e14d58b722ff7c88b4ce450d",
            ),
            "design_A.0/trajectory_00.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_00.csv",
                "3ea9f330443c902711faaf7f99059dd43e42ea30bb4e2d310d78aa1ec897532d",
            ),
            "design_A.0/trajectory_01.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_01.csv",
                "fbac28e9765eb86380a3ecbc75d7fd71ee7283a4b6eda740f486b5d8d670bab3",
            ),
            "design_A.0/trajectory_02.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_02.csv",
                "1dd18e2ef41511253b9d2ca2a51fd1a9cafe5eae7cb8280496f050cdae02db0d",
            ),
            "design_A.0/trajectory_03.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_03.csv",
                "f686c90294ee11e371b949369f7bd80541c74fe358a4e5c28c52dd86e08ac398",
            ),
            "design_A.0/trajectory_04.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_04.csv",
                "b9800f9fba977af0896617a0d535a67e33b20f54361ef3a025659c928dc50658",
            ),
            "design_A.0/trajectory_05.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_05.csv",
                "e0352a2b381189beaab535df7da8a08a6a96dee72c0b5af3a43449734402f133",
            ),
            "design_A.0/trajectory_11.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_11.csv",
                "b2a69f0087aa45cd9372247316eff12c573b9f7110d96ad80fe923e2badbff3b",
            ),
            "design_A.0/trajectory_12.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_12.csv",
                "a5f61491c72ff648bc527f5c50f4d10b79a2f7b3b561f0fdcf4078d98581c0fd",
            ),
            "design_A.0/trajectory_13.csv": (
                "data/experiment_records/design_A.0/20220815/sys_id/trajectory_13.csv",
                "576bd0a89edf58750bb3b2e1ac880551550761b00407cd70e4e300c4db1fcec4",
            ),
            "design_C.1/model_1.1_parameters.yml": (
                "data/system_identification/identified_parameters/design_C.1/model_1.1/model_parameters.yml",
                "c7c69f2cdfcc54f472eb8c59ff1a28cce910b3e9620c1289db2b72cea56186c9",
            ),
            "design_C.1/model_1.1_pendubot.urdf": (
                "data/system_identification/identified_parameters/design_C.1/model_1.1/pendubot.urdf",
                "6e2e4dab56ca3419a321a4d71d1f878c03889202a2a1d111fcc306a982046840",
            ),
            "design_A.0/model_2.1_parameters.yml": (
                "data/system_identification/identified_parameters/design_A.0/model_2.1/model_parameters.yml",
                "43d14672611ad9cef17e8151d3df18499b140e03106c569490ab9e7a1caa7bef",
            ),
            "design_A.0/model_2.1_pendubot.urdf": (
                "data/system_identification/identified_parameters/design_A.0/model_2.1/pendubot.urdf",
                "e1a31f98fde4e5391f5d136dbfb112f105e5813d7cd233383c69e72033056d51",
            ),
        },
    ),
}
