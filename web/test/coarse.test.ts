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

test('no corner of a coarse mesh keeps the light of a surface that is gone, as of the rounded edges of a can', async () => {
  const round = Array.from({ length: 9 }, (_, i) => (Math.PI / 16) * i).map((angle) => new THREE.Vector2(0.0595 + 0.0005 * Math.sin(angle), -0.0395 - 0.0005 * Math.cos(angle)));
  const edge = [...round, ...round.map(({ x, y }) => new THREE.Vector2(x, -y)).reverse()];
  const can = new THREE.Mesh(new THREE.LatheGeometry(edge, 64), new THREE.MeshStandardMaterial());
  await coarsen(can);
  const { index, attributes: { position, normal } } = can.geometry, triangle = new THREE.Triangle(), facet = new THREE.Vector3(), seen = new THREE.Vector3();
  for (let i = 0; i < index!.count; i += 3) {
    triangle.setFromAttributeAndIndices(position!, index!.getX(i), index!.getX(i + 1), index!.getX(i + 2)).getNormal(facet);
    for (let c = 0; c < 3; ++c) expect(seen.fromBufferAttribute(normal!, index!.getX(i + c)).angleTo(facet)).toBeLessThan(0.61);
  }
});

test('the light of a coarse box stops at its edges', async () => {
  const box = new THREE.Mesh(new THREE.BoxGeometry(1, 1, 1, 20, 20, 20), new THREE.MeshStandardMaterial());
  await coarsen(box);
  expect(box.geometry.index!.count / 3).toBe(12);
  const normal = box.geometry.getAttribute('normal');
  expect(normal.count).toBe(24);
  for (let i = 0; i < normal.count; ++i) expect(Math.max(...[normal.getX(i), normal.getY(i), normal.getZ(i)].map(Math.abs))).toBeCloseTo(1);
});

test('what has no triangles by index stays', async () => {
  const mesh = new THREE.Mesh(new THREE.SphereGeometry(0.1, 16, 8).toNonIndexed(), new THREE.MeshStandardMaterial());
  await coarsen(mesh);
  expect(mesh.geometry.index).toBeNull();
});
