// What the viewer takes of three.js (MIT, see three.LICENSE). three.js beside this file is made of it, with npm:
//   npm install three@0.187.0 esbuild
//   npx esbuild three.entry.js --bundle --minify --format=iife --global-name=THREE --outfile=three.js
export {
  BoxGeometry, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, EdgesGeometry, FrontSide,
  HemisphereLight, InstancedMesh, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, PerspectiveCamera, Raycaster,
  Scene, Vector2, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
