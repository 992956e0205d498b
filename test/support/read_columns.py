"""Reads a data set as users will, and says what it holds as JSON: read_columns.py FILE"""
import json
import sys

try:
    import h5py
    import pandas
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

file = h5py.File(sys.argv[1])
table = pandas.DataFrame({k: c[:] for k, c in file["patches"].items() if c.ndim == 1})

patches, clouds = file["patches"], file["clouds"]
surfaces = {v: k for k, v in h5py.check_enum_dtype(patches["surface"].dtype).items()}
names = clouds["name"].asstr()[:]


def numbers(row):
    """Those there are: NaN is no JSON."""
    return [float(x) for x in row if x == x]


print(json.dumps({
    "columns": sorted(table.columns),
    "rows": len(table),
    "clouds": list(names),
    "patches_of": [int(n) for n in clouds["patches"]],
    "cloud_of_last": str(names[table["cloud"].iloc[-1]]),
    "surface_of_first": surfaces[int(table["surface"].iloc[0])],
    "state": numbers(patches["state"][0]),
    "state_covariance": numbers(patches["state_covariance"][0]),
    "parameters": numbers(patches["parameters"][0]),
    "centre": numbers(patches["centre"][0]),
    "normal": numbers(patches["normal"][0]),
    "chi2": float(table["chi2"].iloc[0]),
    "points": int(table["points"].iloc[0]),
    "position": numbers(clouds["position"][0]),
    "settings": [json.loads(s) for s in file["settings/json"].asstr()[:]],
    "failed": list(file["failed/name"].asstr()[:]),
    "reasons": list(file["failed/reason"].asstr()[:]),
}))
