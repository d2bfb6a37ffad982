import * as THREE from 'three';

/** Replaces the renderer in a browser without WebGL: nothing is drawn, everything else works. */
export function blindRenderer(canvas: HTMLCanvasElement): THREE.WebGLRenderer {
  const nothing = (): void => undefined;
  return {
    domElement: canvas,
    shadowMap: {},
    info: { render: {} },
    setAnimationLoop(act: ((time: number) => void) | null) {
      const step = (time: number): void => {
        act?.(time);
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    },
    setPixelRatio: nothing,
    setSize: nothing,
    render: nothing,
    xr: { isPresenting: false, setReferenceSpaceType: nothing, getControllerGrip: () => new THREE.Group() },
  } as unknown as THREE.WebGLRenderer;
}
