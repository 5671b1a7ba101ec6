"""Steps of COLMAP by its Python package, run by FMLGS."""

import os
import sys

step, out, sparse, one_camera, sequential, enough, globally, snapshots, every = sys.argv[1:10]
import pycolmap

database = os.path.join(out, "database.db")
images = os.path.join(out, "images")


def registered(models):
    return max((model.num_reg_images() for model in models.values()), default=0)


def with_snapshots():
    """Arguments that let the incremental mapper write snapshots, as far as this version does."""
    options = getattr(pycolmap, "IncrementalPipelineOptions", None)
    options = options and options()
    names = ("snapshot_frames_freq", "snapshot_images_freq")
    frequency = next((name for name in names if hasattr(options, name)), None)
    if not snapshots or frequency is None or not hasattr(options, "snapshot_path"):
        return {}
    os.makedirs(snapshots, exist_ok=True)
    options.snapshot_path = snapshots
    setattr(options, frequency, int(every))
    return {"options": options}


if step == "features":
    camera = pycolmap.CameraMode.SINGLE if one_camera == "1" else pycolmap.CameraMode.AUTO
    pycolmap.extract_features(database, images, camera_mode=camera)
elif step == "matches" and sequential == "1":
    pairs = getattr(pycolmap, "SequentialPairingOptions", None) or pycolmap.SequentialMatchingOptions
    pairs = pairs()
    pairs.overlap = 15
    pycolmap.match_sequential(database, pairing_options=pairs)
elif step == "matches":
    pycolmap.match_exhaustive(database)
elif step == "mapping":
    found = 0
    if globally == "1" and hasattr(pycolmap, "global_mapping"):
        try:
            found = registered(pycolmap.global_mapping(database, images, sparse))
        except Exception as error:
            print("global mapping failed:", error, file=sys.stderr)
    if found < int(enough):
        # The largest one becomes `0` afterwards.
        beside = os.path.join(sparse, "incremental")
        os.makedirs(beside, exist_ok=True)
        models = pycolmap.incremental_mapping(database, images, beside, **with_snapshots())
        for number in models:
            os.rename(os.path.join(beside, str(number)), os.path.join(sparse, "incremental-%s" % number))
        os.rmdir(beside)
else:
    sys.exit("unknown step: " + step)
