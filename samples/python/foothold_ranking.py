"""Where may a foot step? A map of boulders, its footholds ranked by risk, a picture.

python3 samples/python/foothold_ranking.py    writes foothold_ranking.png
"""

import matplotlib.pyplot as plt
import numpy as np

import holdfast

sensor = holdfast.Sensor.load("kinect_v1")
image = holdfast.simulate("boulder_field", sensor, seed=1, stride=2)
foot = holdfast.Foot.make((0.12, 0.08), friction=0.7, friction_sigma=0.15, gap_m=0.01)

# A camera that stands still sees the ground six times.
patch_map = holdfast.PatchMap(sensor, radius_m=0.09, spacing_m=0.06)
for seed in range(6):
    patch_map.update(image.draw(seed))

# Down in the scene, in the frame of the map: that of the camera at first.
scene_from_camera = image.sensor_pose[:3, :3]
down = scene_from_camera.T @ [0.0, 0.0, -1.0]
ranking = holdfast.rank_footholds(patch_map, foot, down, spacing_m=0.1, threads=0)
best = ranking.footholds

print(f"{len(best)} footholds on {len(patch_map)} patches; {ranking.counts}")
for risk in best[:3]:
    height_sigma = 1e3 * np.sqrt(down @ risk.pose_covariance[3:, 3:] @ down)
    print(
        f"  total {risk.total:.2g} (slip {risk.slip:.2g}, gap {risk.gap:.2g}),"
        f" independent views: {risk.views}, height +- {height_sigma:.1f} mm"
    )
print("taken for granted: " + "; ".join(ranking.assumptions))

# The soles as they will lie, over the image.
corners = np.column_stack([foot.sole, np.zeros(len(foot.sole))])
soles = best.pose[:, None, :3, 3] + corners @ best.pose[:, :3, :3].transpose(0, 2, 1)
pixels = soles @ sensor.camera_matrix.T
pixels = pixels[..., :2] / pixels[..., 2:]

colours = plt.get_cmap("RdYlGn_r")
height, width = sensor.size
plt.figure(figsize=(9, 6.5))
plt.imshow(image.points[..., 2], cmap="gray", extent=(0, width, height, 0))
for outline, total in zip(pixels, best.total):
    plt.fill(*outline.T, color=colours(total), alpha=0.8)
plt.colorbar(plt.cm.ScalarMappable(cmap=colours), ax=plt.gca(), label="total risk")
plt.axis((0, width, height, 0))
plt.title("Soles where they may be put, over the depth image")
plt.savefig("foothold_ranking.png", dpi=100)
