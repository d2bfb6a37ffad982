import * as THREE from 'three';
import { expect, test } from 'vitest';
import { coarsen } from '../src/scene/coarse';

test('a coarse mesh has few of the triangles, 1 mm off at most, and keeps its colour and what is seen in it', async () => {
  const radius = 0.06, unit = 0.001; // in mm, as meshes that a node scales
  const ball = new THREE.Mesh(new THREE.SphereGeometry(radius / unit, 128, 64), new THREE.MeshStandardMaterial({ color: 0x2b6cb0 }));
  const node = new THREE.Group();
  ball.scale.setScalar(unit);
  node.add(ball);
  const before = ball.geometry.index!.count;
  await coarsen(node);
  const corners = ball.geometry.index!, place = ball.geometry.getAttribute('position');
  expect(corners.count).toBeLessThan(before / 10);
  expect(corners.count).toBeGreaterThan(30);
  const sum = new THREE.Vector3(), corner = new THREE.Vector3(), box = new THREE.Box3();
  for (let i = 0; i < corners.count; i += 3) {
    sum.set(0, 0, 0);
    for (let c = 0; c < 3; ++c) {
      corner.fromBufferAttribute(place, corners.getX(i + c)).multiplyScalar(unit);
      box.expandByPoint(corner);
      sum.add(corner);
    }
    expect(radius - sum.length() / 3).toBeLessThan(0.0025); // the middle of a facet whose edges are some 1 mm off
  }
  expect(box.getSize(sum).x).toBeGreaterThan(2 * radius - 0.002);
  const { material } = ball as THREE.Mesh;
  expect(material).toBeInstanceOf(THREE.MeshLambertMaterial);
  expect((material as THREE.MeshLambertMaterial).color.getHex()).toBe(0x2b6cb0);
});

test('what has no triangles by index stays', async () => {
  const mesh = new THREE.Mesh(new THREE.SphereGeometry(0.1, 16, 8).toNonIndexed(), new THREE.MeshStandardMaterial());
  await coarsen(mesh);
  expect(mesh.geometry.index).toBeNull();
});
