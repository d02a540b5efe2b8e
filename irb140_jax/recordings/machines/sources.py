"""Where the published recordings come from: repository, commit, path and SHA-256 of every file that is read here."""

import urllib.parse
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
        path = urllib.parse.quote(self.files[name][0])
        return f"https://raw.githubusercontent.com/{self.repository}/{self.commit}/{path}"


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
    "cycloidal_play": Source(
        "JelmerV/Anti-Backlash-Cycloidal-Actuator", "a5fe58d41bdcc9a72f28b00e12de10c8ebd178c3", "CC-BY-SA-4.0",
        {
            "2024-07-17__15-49-43__torqueramp__base_onyx init1.csv": (
                "Code/test_data/2024-07-17__15-49-43__torqueramp__base_onyx init1.csv",
                "25ee896c6eb3e7c77280420d808df7561b698223ed5e3c70c7f280978c34202d",
            ),
            "2024-07-18__10-58-26__torqueramp__base_onyx runin1.csv": (
                "Code/test_data/2024-07-18__10-58-26__torqueramp__base_onyx runin1.csv",
                "75b9be6d748349a8ead0122f08d8dae161719978cdd947cd62a7e580ab82292c",
            ),
            "2024-07-18__11-02-28__torqueramp__base_onyx runin5.csv": (
                "Code/test_data/2024-07-18__11-02-28__torqueramp__base_onyx runin5.csv",
                "facd8517eacdb02eb4f8f2841c44793cd2e3d5c97c1033705c0a3a2ca52f9c2a",
            ),
            "2024-07-18__11-17-26__torqueramp__base_onyx runin6.csv": (
                "Code/test_data/2024-07-18__11-17-26__torqueramp__base_onyx runin6.csv",
                "7f5f6a350ca47d6df95a3a1aa8632b61204d71d08ec1bce1333794dc96141501",
            ),
            "2024-07-18__16-28-57__torqueramp__split_onyx runin1.csv": (
                "Code/test_data/2024-07-18__16-28-57__torqueramp__split_onyx runin1.csv",
                "44f3ff487e54d8891d6fab0f6050baab5549a86e633eb5b2434c6aa3e0963337",
            ),
            "2024-07-18__16-32-24__torqueramp__split_onyx runin5.csv": (
                "Code/test_data/2024-07-18__16-32-24__torqueramp__split_onyx runin5.csv",
                "c3c4407c9d817646d9224939e7d4aed6cb45bba6a82dea2f9e55507a6c8ccc15",
            ),
            "2024-07-18__17-36-03__torqueramp__split_onyx 3pre1.csv": (
                "Code/test_data/2024-07-18__17-36-03__torqueramp__split_onyx 3pre1.csv",
                "556a0c90ea5029537fc88e3f86666e27bf2493f0ab9d6165ee6a9f96f1c1871a",
            ),
            "2024-07-18__18-30-11__torqueramp__split_onyx 6pre1.csv": (
                "Code/test_data/2024-07-18__18-30-11__torqueramp__split_onyx 6pre1.csv",
                "8f2c74045f855c84c2e664e05be9e4d6aeb3bfdbe9fde0d020ae4575a285ae72",
            ),
            "2024-07-19__12-45-43__torqueramp__split_onyx 12pre1.csv": (
                "Code/test_data/2024-07-19__12-45-43__torqueramp__split_onyx 12pre1.csv",
                "9b9e4b59b01ca91f36d3aa4ad590e3d145d132d8808558e252b915c79ce8bf6e",
            ),
            "2024-07-19__12-49-55__torqueramp__split_onyx 12pre5.csv": (
                "Code/test_data/2024-07-19__12-49-55__torqueramp__split_onyx 12pre5.csv",
                "3ae5d7d390291f3ff3ce999e83fb0e521532bf615967a2c028cb9ba2d953d3c6",
            ),
        },
    ),
    "bam_xl330": Source(
        "Rhoban/bam", "af2260462471ff45ac18af159b1327ea51d8db15", "Apache-2.0",
        {
            "2026-01-15_10h28m10.json": (
                "bam/data.bak/raw/2026-01-15_10h28m10.json",
                "e58f3c2a08a5e0e37a2c5e930d0830a438bc102b8d21482767124f495b92f2ce",
            ),
            "2026-01-15_10h28m17.json": (
                "bam/data.bak/raw/2026-01-15_10h28m17.json",
                "ef6507934ba465eb31529d7d98715ecc70bd5c87be049fd4618a94ce39290569",
            ),
            "2026-01-15_10h28m24.json": (
                "bam/data.bak/raw/2026-01-15_10h28m24.json",
                "165b171df12b3e8b39504ce36d37e373ad105c0dddf4d3d073c747fd492e8bef",
            ),
            "2026-01-15_10h28m32.json": (
                "bam/data.bak/raw/2026-01-15_10h28m32.json",
                "fdc255edae6995298af437f37582eb8cd0c4a5ddcec4f49fb7c4d6f3303aaa9c",
            ),
            "2026-01-15_10h28m42.json": (
                "bam/data.bak/raw/2026-01-15_10h28m42.json",
                "1c6386bfa3be021c8ca8a96a7cbee93914f6271a050282b1c3b7d5ef373427db",
            ),
            "2026-01-15_10h28m49.json": (
                "bam/data.bak/raw/2026-01-15_10h28m49.json",
                "e2223826274fca7799a2be0cb371e4269ead88cd9077fbb68498ef93e4e0de97",
            ),
            "2026-01-15_10h28m57.json": (
                "bam/data.bak/raw/2026-01-15_10h28m57.json",
                "c10a350d9c7222d4d3499d140edd3ac4e63fe94f3b59a675116a34db7d66152c",
            ),
            "2026-01-15_10h29m04.json": (
                "bam/data.bak/raw/2026-01-15_10h29m04.json",
                "7996c43314a9f60094a6119346b54ff9ff84cb6726c967f4a88a7175278f6515",
            ),
            "2026-01-15_10h29m14.json": (
                "bam/data.bak/raw/2026-01-15_10h29m14.json",
                "016d15d21c464457aa30eaeab3977228b08cd5acf7542f24067440126c0bf480",
            ),
            "2026-01-15_10h29m21.json": (
                "bam/data.bak/raw/2026-01-15_10h29m21.json",
                "fe68cff62e976c87a2fcab925a517fbff83be16c862693310fdc1eff743eddab",
            ),
            "2026-01-15_10h29m29.json": (
                "bam/data.bak/raw/2026-01-15_10h29m29.json",
                "b9ce9fc0f396e6b03bd514e9254cb83b8a64e1a5df1728b9a10e3b4a5a9513ca",
            ),
            "2026-01-15_10h29m37.json": (
                "bam/data.bak/raw/2026-01-15_10h29m37.json",
                "838d390b7190c4ce1608157cf629989648773b7336728a0931a61c6018c6700b",
            ),
            "2026-01-15_10h29m47.json": (
                "bam/data.bak/raw/2026-01-15_10h29m47.json",
                "61ae8eeb881be5d8c09f6c7fba4cef39f66b1ff03e0148ef3bc0e314054513f5",
            ),
            "2026-01-15_10h29m54.json": (
                "bam/data.bak/raw/2026-01-15_10h29m54.json",
                "b50055742ee553a8cb849b38d04d2b9bcf7143d0acefe6539f922984b93d958a",
            ),
            "2026-01-15_10h30m02.json": (
                "bam/data.bak/raw/2026-01-15_10h30m02.json",
                "040e065f9885833fa909683f13665f90048ce5457d94dd2a3af056c21c36210d",
            ),
            "2026-01-15_10h30m10.json": (
                "bam/data.bak/raw/2026-01-15_10h30m10.json",
                "01d32db99e7859f012a230aca59f1dda24219d6781472d356861b138526213e6",
            ),
        },
    ),
}


# Files that were made from published ones: they lie with those that are fetched, and can't be downloaded as they are.
DERIVED = {
    "unitree_go2": Source(
        "iit-DLSLab/sim2real-robot-identification", "06739ea0424fa8b2e141df0942ecdaf27a5c8600", "BSD-3-Clause",
        {
            "log.csv": (
                "datasets/go2/traj_0.pt",
                "cf90d01f91be2bf59180935758198079fe1d0a31b6327345bebaa2943e7154e4",
            ),
            "go2_fixed_base_nominal.xml": (
                "robot_model/go2/go2.xml",
                "a92c1c0a7057c5716d0fc6bbcab43c87787d77ff3ccaf3f5b71c25de67ed59a8",
            ),
        },
    ),
    "so101": Source(
        "isaac-sim2real/sage", "4ffd2627df9d23e279b35712a67e629ce0c0dfa7", "Apache-2.0",
        {
            "backlash_detection.csv": (
                "output/real/so101/custom/backlash_detection/state_motor.csv",
                "2052fa7339984b66604311d3181ec686e816d8e08d07c94d2dacdb907564236e",
            ),
            "chirp_sweep.csv": (
                "output/real/so101/custom/chirp_sweep/state_motor.csv",
                "e17f2734270fc909d4b87dfbaa564a8f9bdf153d6256879c9e8f75fba3a46f7c",
            ),
            "friction_gravity.csv": (
                "output/real/so101/custom/friction_gravity/state_motor.csv",
                "6b255b3f3ce56d7a7b0b8ab0e852b71684af2f73fdf97a170d6e2ef087dc1f2a",
            ),
            "hold_under_gravity.csv": (
                "output/real/so101/custom/hold_under_gravity/state_motor.csv",
                "2d88d8400d23a175767f5f20d133a6be35f6568f20e91aa904187ca27c59fd67",
            ),
            "large_amplitude.csv": (
                "output/real/so101/custom/large_amplitude/state_motor.csv",
                "b78855c31f2a920463f77377e3e82b847043dbe8311a6a33e6815f564436b1ed",
            ),
            "multisine.csv": (
                "output/real/so101/custom/multisine/state_motor.csv",
                "ebfb582500374306360b15a98d48403bb622c1cf2dab5a1290c1bd68eb12ce18",
            ),
            "pick_place.csv": (
                "output/real/so101/custom/pick_place/state_motor.csv",
                "b57fa2bcc3b1f7cd7f3d07f15a72abfc005e2a04a45d8904a1caea37768d5137",
            ),
            "prbs_excitation.csv": (
                "output/real/so101/custom/prbs_excitation/state_motor.csv",
                "bbc368c503c4752702a60f04d5cde0a35d03f7352211d8ab1ca34991a805a25d",
            ),
            "single_joint_elbow.csv": (
                "output/real/so101/custom/single_joint_elbow/state_motor.csv",
                "d588687529a939b28cdbb3067d2801976ba0690379f6c76c71cd22db5b72c007",
            ),
            "single_joint_rotation.csv": (
                "output/real/so101/custom/single_joint_rotation/state_motor.csv",
                "faf17b12f8dd1f588f09e5f2fb79f7b3dcee0f76af4f3a3f1a836af76d26814d",
            ),
            "single_joint_wrist_roll.csv": (
                "output/real/so101/custom/single_joint_wrist_roll/state_motor.csv",
                "48d59be60b9e31f3af65fb1ff5b9da50ae7129df22c52040506dbd285fd581e8",
            ),
            "static_holding.csv": (
                "output/real/so101/custom/static_holding/state_motor.csv",
                "cf77c5c8860493feee1390ab227e97a8b210c84f2fc67a909924570d9e8f88c8",
            ),
            "step_response.csv": (
                "output/real/so101/custom/step_response/state_motor.csv",
                "7567986590c8bc594e0f93ec33764c4d146cedbe0568525cda4aa221c5bd4a16",
            ),
            "velocity_ramp.csv": (
                "output/real/so101/custom/velocity_ramp/state_motor.csv",
                "1edd3e6a30ad229949ded83a30228c0ddc9231e8cfa8191564b8ccdfbd401b6f",
            ),
            "so101_new_calib.urdf": (
                "Simulation/SO101/so101_new_calib.urdf",  # of TheRobotStudio/SO-ARM100, commit fda892cb
                "1b29612da183d4a670771f35fc40f487d1a2f8c646ae58220cf3061958a7dd26",
            ),
        },
    ),
}
