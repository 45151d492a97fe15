"""The camera systems that creepkit knows, one declaration each.

Names of columns are those of the systems' own exports. Axes depend on how a system was set up: VIC-3D, Zeiss and DICe
are read as they are, as of a plane whose z was laid towards the cameras; of MatchID it is assumed that y points down
and z to the cameras, left-handed axes of which y alone is turned; pyvale writes where points are now, in the axes of
camera 0 (x to the right, y down, z away from it). Where a surface that bulges towards the cameras comes out negative, z
points away, as it does in the plane that DICe fits to its own examples: read it with `dataclasses.replace(format,
axes=(1, -1, -1))`.
"""

from __future__ import annotations

from creepkit.hookspecs import hookimpl
from creepkit.records.camera_format import CameraFormat

VIC_3D = CameraFormat(
    "vic-3d",
    "VIC-3D, CSV of one or several images",
    {"x": "X", "y": "Y", "z": "Z", "u": "U", "v": "V", "w": "W"},
    lost={"sigma": "< 0"},
    patterns=("*.csv", "*.txt"),
)


VIC_3D_MAT = CameraFormat(
    "vic-3d-mat",
    "VIC-3D, arrays of MATLAB, lengths in mm",
    {"x": "X", "y": "Y", "z": "Z", "u": "U", "v": "V", "w": "W"},
    unit="mm",
    lost={"sigma": "< 0"},
    patterns=("*.mat",),
)


DICE = CameraFormat(
    "dice",
    "DICe, table of a stereo analysis, lengths in mm",
    {
        "x": "MODEL_COORDINATES_X",
        "y": "MODEL_COORDINATES_Y",
        "z": "MODEL_COORDINATES_Z",
        "u": "MODEL_DISPLACEMENT_X",
        "v": "MODEL_DISPLACEMENT_Y",
        "w": "MODEL_DISPLACEMENT_Z",
    },
    unit="mm",
    lost={"SIGMA": "< 0"},
    patterns=("*.txt", "*.csv"),
)


MATCHID = CameraFormat(
    "matchid",
    "MatchID, names of 2024.1 or of 2023 (lengths in mm)",
    (
        {
            "x": "coor.X",
            "y": "coor.Y",
            "z": "coor.Z",
            "u": ("disp.Horizontal Displacement U", "disp.Horizontal Displacement: U"),
            "v": ("disp.Vertical Displacement V", "disp.Vertical Displacement: V"),
            "w": ("disp.Out-Of-Plane: W", "disp.Out-Of-Plane Displacement W"),
        },
        {
            "image_x": "x_pic",
            "image_y": "y_pic",
            "x": "x [mm]",
            "y": "y [mm]",
            "z": "z [mm]",
            "u": "u [mm]",
            "v": "v [mm]",
            "w": "w [mm]",
        },
    ),
    axes=(1, -1, 1),
    patterns=("*.csv", "*.txt"),
)


ZEISS = CameraFormat(
    "zeiss",
    "Zeiss and GOM, nodemap.txt",
    {"x": "x_undef", "y": "y_undef", "z": "z_undef", "u": "u", "v": "v", "w": "w"},
    patterns=("*.txt", "*.csv"),
)


PYVALE = CameraFormat(
    "pyvale",
    "pyvale, CSV of a stereo correlation",
    {
        "x": "stereo_x",
        "y": "stereo_y",
        "z": "stereo_z",
        "u": "stereo_disp_u",
        "v": "stereo_disp_v",
        "w": "stereo_disp_w",
    },
    deformed=True,
    axes=(1, -1, -1),
    lost={"converged": "== 0", "stereo_converged": "== 0"},
    patterns=("*.csv", "*.txt"),
)


FORMATS = (VIC_3D, VIC_3D_MAT, DICE, MATCHID, ZEISS, PYVALE)


@hookimpl
def creepkit_cameras() -> list[CameraFormat]:
    """Return the formats of the camera systems that creepkit knows."""
    return list(FORMATS)
